// Which records are made, when and where.

#include "caching/record_layer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <type_traits>

#include "core/error.h"
#include "core/hash_bits.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// So many records are made at once: enough for threads, few enough that hardly any is made where
// another one of them reaches.
constexpr std::size_t kBatch = 32;

void go_on(const Progress& progress, double share) {
  if (progress && !progress(share)) throw Error(ErrorKind::cancelled, "stopped");
}

// What is different between the two kinds.
template <typename Value>
constexpr bool kEven = std::is_same_v<Value, RadianceValue>;

template <typename Value>
Value value_of(const Hemisphere& h) {
  if constexpr (kEven<Value>) {
    return radiance_value(h);
  } else {
    return record_value(h);
  }
}

// The light of `then` alone, `now` being the same strata of light `value`.
RecordValue light_of(const Hemisphere& then, const Hemisphere&, const RecordValue&) {
  return record_value(then);
}
RadianceValue light_of(const Hemisphere& then, const Hemisphere& now, const RadianceValue& value) {
  return coefficients_of(then, now, value);
}

double ratio_of(const RecordValue& now, const RecordValue& next, const LobeView&,
                const LobeHarmonics*) {
  return temporal_ratio(now.irradiance, next.irradiance);
}
double ratio_of(const RadianceValue& now, const RadianceValue& next, const LobeView& view,
                const LobeHarmonics* lobes) {
  return temporal_ratio(now, next, view, *lobes);
}

// |a - b| as a share of the larger of the two, summed over channels or coefficients: a place that
// is all but dark counts as much as any other, and not for more.
double difference(const RecordValue& a, const RecordValue& b) {
  const double size = std::max(l1_norm(a.irradiance), l1_norm(b.irradiance));
  return size > 0 ? l1_norm(a.irradiance - b.irradiance) / size : 0;
}
double difference(const RadianceValue& a, const RadianceValue& b) {
  double size_a = 0, size_b = 0, off = 0;
  for (std::size_t i = 0; i < b.coefficient.size(); ++i) {
    size_a += std::abs(static_cast<double>(a.coefficient[i]));
    size_b += std::abs(static_cast<double>(b.coefficient[i]));
    off += std::abs(static_cast<double>(a.coefficient[i] - b.coefficient[i]));
  }
  const double size = std::max(size_a, size_b);
  return size > 0 ? off / size : 0;
}

double pixel_metres(const Camera& camera, const Vec3& position) {
  return length(position - camera.position) * 2 * std::tan(camera.vertical_fov / 2) / camera.height;
}

}  // namespace

template <typename Value>
bool RecordLayer<Value>::wants(const GatherPoint& point) {
  return kEven<Value> ? point.glossy : point.broad;
}

template <typename Value>
void RecordLayer<Value>::begin(const CachedFrame& frame) {
  if (!options_.temporal) cache_.clear();
  cache_.begin(frame.number, frame.now->scene);
}

template <typename Value>
void RecordLayer<Value>::make(const CachedFrame& frame, const std::vector<Request>& requests,
                              RecordReport& report) {
  struct Made {
    CacheRecord<Value> record;
    double least = 0, hemisphere_ms = 0, reproject_ms = 0;
    std::size_t rays = 0;
  };
  std::vector<Made> made(requests.size());
  parallel_for(static_cast<int>(requests.size()), [&](int number) {
    const Request& request = requests[static_cast<std::size_t>(number)];
    Made& m = made[static_cast<std::size_t>(number)];
    auto begin = Clock::now();
    CacheRecord<Value>& r = m.record;
    r.place = request.place, r.key = request.key, r.born = frame.number;
    r.lobe = request.lobe, r.to_viewer = request.to_viewer;
    const PlaceFrame at = place_in(frame.now->scene, r.place);
    Hemisphere h = stratified_hemisphere(options_.hemisphere_samples, r.key, kEven<Value>);
    std::vector<SeenPlace> seen;
    gather_hemisphere(*frame.tracer, at, r.key, h, options_.temporal ? &seen : nullptr);
    r.value = value_of<Value>(h);
    const double pixel = pixel_metres(frame.camera, at.position) / options_.accuracy;
    m.least = std::max(options_.least_spacing * pixel, 1e-9);
    r.radius = record_radius(r.value, harmonic_mean_distance(h), m.least,
                             std::max(options_.most_spacing * pixel, m.least));
    r.value = limited(std::move(r.value), r.radius);
    m.hemisphere_ms = ms_since(begin), m.rays = h.direction.size();
    if (!options_.temporal) return;
    begin = Clock::now();
    ReprojectionReport changes;
    const Hemisphere next = reprojected(h, seen, r.place, *frame.change, &changes);
    r.life = options_.age.longest;
    if (changes.moved + changes.covered + changes.holes > 0) {
      const bool gradients = options_.gradients == TemporalGradients::extrapolated;
      const Value then =
          gradients ? limited(value_of<Value>(next), r.radius) : light_of(next, h, r.value);
      const LobeView view{r.lobe, at.to_local(r.to_viewer)};
      r.life = lifespan(ratio_of(r.value, then, view, frame.lobes), options_.age);
      if (gradients) r.change = then - r.value;
    }
    m.reproject_ms = ms_since(begin);
  });
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (const auto old = requests[i].replaces) {
      ++report.replaced;
      CacheRecord<Value>& before = cache_.record(*old);
      if (options_.gradients == TemporalGradients::interpolated) {
        before.change =
            (made[i].record.value - before.value) * (1.0 / (frame.number - before.born));
      }
    } else {
      ++report.made;
    }
    report.rays += static_cast<double>(made[i].rays);
    report.hemisphere_ms += made[i].hemisphere_ms, report.reproject_ms += made[i].reproject_ms;
    cache_.add(std::move(made[i].record), made[i].least);
  }
}

template <typename Value>
void RecordLayer<Value>::update(const CachedFrame& frame, const GatherPoints& points,
                                RecordReport& report, const Progress& progress) {
  // Culled replacement: what had no part in the last picture is left behind.
  std::vector<Request> requests;
  for (std::uint32_t i = 0; i < cache_.records().size(); ++i) {
    const CacheRecord<Value>& r = cache_.records()[i];
    if (frame.number - r.born != r.life || r.last_used != frame.number - 1) continue;
    requests.push_back({r.place, r.key, i, r.lobe, r.to_viewer});
  }
  make(frame, requests, report);

  // New ones from far pixels to near ones; then all pixels again for those that were covered until
  // neighbours were clamped.
  constexpr int kCoarsest = 16, kRounds = 10;
  struct Pixel {
    std::uint64_t order;
    int x, y;
  };
  const auto each_bare = [&](const Pixel& p, const auto& visit) {
    const auto y = static_cast<std::size_t>(p.y), x = static_cast<std::size_t>(p.x);
    for (std::size_t i = points.first[y][x]; i < points.first[y][x + 1]; ++i) {
      const GatherPoint& point = points.row[y][i];
      if (wants(point) && !cache_.covers(point.position, point.normal)) visit(point);
    }
  };
  const int width = points.without.width, height = points.without.height;
  int stride = kCoarsest;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Pixel> pixels;
    for (int y = 0; y < height; y += stride) {
      for (int x = 0; x < width; x += stride) {
        pixels.push_back({mix_bits(options_.seed, points.without.index(x, y)), x, y});
      }
    }
    std::vector<std::uint8_t> bare(pixels.size());
    parallel_for(
        static_cast<int>(pixels.size()),
        [&](int i) {
          const auto n = static_cast<std::size_t>(i);
          each_bare(pixels[n], [&](const GatherPoint&) { bare[n] = 1; });
        },
        256);
    std::vector<Pixel> left;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (bare[i]) left.push_back(pixels[i]);
    }
    if (stride == 1 && left.empty()) break;
    // Scattered over the picture, so that records of one batch are seldom neighbours.
    std::sort(left.begin(), left.end(),
              [](const Pixel& a, const Pixel& b) { return a.order < b.order; });
    for (std::size_t next = 0; next < left.size();) {
      requests.clear();
      while (next < left.size() && requests.size() < kBatch) {
        std::uint64_t key = left[next].order ^ (kEven<Value> ? 0x9055 : 0);
        each_bare(left[next++], [&](const GatherPoint& point) {
          requests.push_back(
              {point.place, key = mix_bits(key, 1), std::nullopt, point.lobe, -point.direction});
        });
      }
      make(frame, requests, report);
      const double done = static_cast<double>(next) / static_cast<double>(left.size());
      go_on(progress, (round + done) / kRounds);
    }
    stride = std::max(stride / 2, 1);
  }
  report.alive += cache_.alive_count();
}

template <typename Value>
void RecordLayer<Value>::close(const CachedFrame& frame, RecordReport& report) {
  std::vector<Request> requests;
  for (const std::uint32_t i : cache_.alive()) {
    const CacheRecord<Value>& r = cache_.records()[i];
    if (r.born < frame.number && r.last_used == frame.number) {
      requests.push_back({r.place, r.key, i, r.lobe, r.to_viewer});
    }
  }
  make(frame, requests, report);
}

template <typename Value>
void RecordLayer<Value>::check(const CachedFrame& frame, const FrameTracer& next,
                               RecordReport& report) const {
  const std::vector<std::uint32_t> alive = cache_.alive();
  const std::size_t count = std::min(alive.size(), static_cast<std::size_t>(options_.check));
  if (count == 0) return;
  const AnimatedFrame& later = next.frame();
  const FrameChange change(*frame.now, later);
  struct Found {
    double off, reprojected, still;
  };
  std::vector<Found> found(count);
  parallel_for(static_cast<int>(count), [&](int number) {
    const auto n = static_cast<std::size_t>(number);
    const CacheRecord<Value>& r = cache_.records()[alive[n * alive.size() / count]];
    Hemisphere h = stratified_hemisphere(options_.hemisphere_samples, r.key, kEven<Value>);
    Hemisphere then = h;
    std::vector<SeenPlace> seen;
    gather_hemisphere(*frame.tracer, place_in(frame.now->scene, r.place), r.key, h, &seen);
    gather_hemisphere(next, place_in(later.scene, r.place), r.key, then, nullptr);
    const Value fresh = value_of<Value>(h), wanted = value_of<Value>(then);
    const Value shown = r.value + r.change * (frame.number - r.born);
    found[n] = {difference(shown, fresh),
                difference(value_of<Value>(reprojected(h, seen, r.place, change)), wanted),
                difference(fresh, wanted)};
  });
  for (const Found& f : found) {
    report.off += f.off, report.reprojection_error += f.reprojected, report.still_error += f.still;
  }
  report.checked += count;
}

template class RecordLayer<RecordValue>;
template class RecordLayer<RadianceValue>;

}  // namespace haarlight
