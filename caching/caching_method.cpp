// Caching methods: which records are made, when, and what pictures they give.

#include "caching/caching_method.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "caching/path_picture.h"
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
// another one of them reaches. A constant, so that pictures do not depend on threads.
constexpr std::size_t kBatch = 32;

void go_on(const Progress& progress, double share) {
  if (progress && !progress(share)) throw Error(ErrorKind::cancelled, "stopped");
}

// |a - b| as a share of b, a mean of channels.
double difference(const RgbD& a, const RgbD& b) {
  const double size = l1_norm(b);
  return size > 0 ? l1_norm(a - b) / size : 0;
}

}  // namespace

// A frame, the one after it, and rays in the first.
struct CachingMethod::Frame {
  int number;
  std::unique_ptr<AnimatedFrame> now, next;
  std::unique_ptr<FrameTracer> tracer;
  std::unique_ptr<FrameChange> change;
  Camera camera;
  double build_ms = 0;
};

struct CachingMethod::Report {
  int made = 0, replaced = 0;
  std::size_t alive = 0;
  double rays = 0;
  double update_ms = 0;                        // by the clock
  double hemisphere_ms = 0, reproject_ms = 0;  // summed over threads
  double accuracy = 1, reprojection_error = 0, still_error = 0;
};

struct CachingMethod::Request {
  BodyPlace place;
  std::uint64_t key;
  std::optional<std::uint32_t> replaces;
};

CachingMethod::CachingMethod(const AnimatedScene& scene, const CachingOptions& options)
    : scene_(scene), options_(options), cache_(options.accuracy) {
  const auto wanted = [](bool right, const char* what) {
    if (!right) throw Error(ErrorKind::invalid_argument, what);
  };
  wanted(options.accuracy > 0 && options.accuracy <= 1, "accuracy of records, expected (0, 1]");
  wanted(options.least_spacing > 0 && options.least_spacing <= options.most_spacing,
         "spacing of records, expected 0 < least <= most pixels");
  wanted(options.hemisphere_samples >= 1, "samples of a hemisphere, expected at least 1");
  wanted(options.age.accuracy > 0 && options.age.longest >= 1,
         "age of records, expected an accuracy above 0 and at least 1 frame");
  if (!options.temporal) options_.gradients = TemporalGradients::none;
}

CachingMethod::~CachingMethod() = default;

bool CachingMethod::two_passes() const {
  return options_.gradients == TemporalGradients::interpolated;
}

double CachingMethod::prepare_share() const { return two_passes() ? 0.8 : 0; }

std::vector<std::string> CachingMethod::figures() const {
  std::vector<std::string> names{"records_new",   "records_replaced", "records_alive",
                                 "rays",          "build_ms",         "update_ms",
                                 "hemisphere_ms", "reproject_ms",     "render_ms"};
  if (options_.check > 0) {
    for (const char* name : {"accuracy", "reprojection_error", "still_error"}) {
      names.emplace_back(name);
    }
  }
  return names;
}

void CachingMethod::go_to(int number) {
  const auto begin = Clock::now();
  auto to = std::make_unique<Frame>();
  to->number = number;
  if (now_ && now_->number + 1 == number && now_->next) {
    to->now = std::move(now_->next);
  } else {
    to->now = std::make_unique<AnimatedFrame>(scene_.at(number));
  }
  to->camera = frame_camera(*to->now, options_.width, options_.height);
  to->tracer = std::make_unique<FrameTracer>(*to->now);
  if (options_.temporal) {
    to->next = std::make_unique<AnimatedFrame>(scene_.at(number + 1));
    to->change = std::make_unique<FrameChange>(*to->now, *to->next);
  }
  now_ = std::move(to);
  now_->build_ms = ms_since(begin);
}

double CachingMethod::pixel_metres(const Vec3& position) const {
  const Camera& camera = now_->camera;
  return length(position - camera.position) * 2 * std::tan(camera.vertical_fov / 2) / camera.height;
}

void CachingMethod::make(const std::vector<Request>& requests, Report& report) {
  struct Made {
    CacheRecord record;
    double least = 0, hemisphere_ms = 0, reproject_ms = 0;
    std::size_t rays = 0;
  };
  std::vector<Made> made(requests.size());
  parallel_for(static_cast<int>(requests.size()), [&](int number) {
    const Request& request = requests[static_cast<std::size_t>(number)];
    Made& m = made[static_cast<std::size_t>(number)];
    auto begin = Clock::now();
    CacheRecord& r = m.record;
    r.place = request.place, r.key = request.key, r.born = now_->number;
    const PlaceFrame at = place_in(now_->now->scene, r.place);
    Hemisphere h = stratified_hemisphere(options_.hemisphere_samples, r.key);
    std::vector<SeenPlace> seen;
    gather_hemisphere(*now_->tracer, at, r.key, h, options_.temporal ? &seen : nullptr);
    r.value = record_value(h);
    const double pixel = pixel_metres(at.position) / options_.accuracy;
    m.least = std::max(options_.least_spacing * pixel, 1e-9);
    r.radius = record_radius(r.value, harmonic_mean_distance(h), m.least,
                             std::max(options_.most_spacing * pixel, m.least));
    r.value = limited(r.value, r.radius);
    m.hemisphere_ms = ms_since(begin), m.rays = h.direction.size();
    if (!options_.temporal) return;
    begin = Clock::now();
    const Hemisphere next = reprojected(h, seen, r.place, *now_->change);
    const RecordValue then = limited(record_value(next), r.radius);
    r.life = lifespan(temporal_ratio(r.value.irradiance, then.irradiance), options_.age);
    if (options_.gradients == TemporalGradients::extrapolated) r.change = then - r.value;
    m.reproject_ms = ms_since(begin);
  });
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (const auto old = requests[i].replaces) {
      ++report.replaced;
      CacheRecord& before = cache_.record(*old);
      if (two_passes()) {
        before.change =
            (made[i].record.value - before.value) * (1.0 / (now_->number - before.born));
      }
    } else {
      ++report.made;
    }
    cache_.add(made[i].record, made[i].least);
    report.rays += static_cast<double>(made[i].rays);
    report.hemisphere_ms += made[i].hemisphere_ms, report.reproject_ms += made[i].reproject_ms;
  }
}

// Records whose life ended with the last frame and that had a part in its picture are replaced
// where they are; the others are left behind (culled replacement).
void CachingMethod::replace_old(Report& report) {
  std::vector<Request> requests;
  for (std::uint32_t i = 0; i < cache_.records().size(); ++i) {
    const CacheRecord& r = cache_.records()[i];
    if (r.born + r.life != now_->number || r.last_used != now_->number - 1) continue;
    requests.push_back({r.place, r.key, i});
  }
  make(requests, report);
}

// From far pixels to near ones, new records wherever none counts; all pixels again for those that
// were covered until neighbours were clamped.
void CachingMethod::fill(const GatherPoints& points, Report& report, const Progress& progress) {
  constexpr int kCoarsest = 16, kRounds = 10;
  struct Pixel {
    std::uint64_t order;
    int x, y;
  };
  const auto each_point = [&](const Pixel& p, const auto& visit) {
    const auto y = static_cast<std::size_t>(p.y), x = static_cast<std::size_t>(p.x);
    for (std::size_t i = points.first[y][x]; i < points.first[y][x + 1]; ++i) {
      const GatherPoint& point = points.row[y][i];
      if (point.broad && !cache_.covers(point.position, point.normal)) visit(point);
    }
  };
  int stride = kCoarsest, rounds = 0;
  while (rounds < kRounds) {
    std::vector<Pixel> pixels;
    for (int y = 0; y < options_.height; y += stride) {
      for (int x = 0; x < options_.width; x += stride) {
        const std::size_t number = points.without.index(x, y);
        pixels.push_back({mix_bits(options_.seed, number), x, y});
      }
    }
    std::vector<std::uint8_t> bare(pixels.size());
    parallel_for(
        static_cast<int>(pixels.size()),
        [&](int i) {
          const auto n = static_cast<std::size_t>(i);
          each_point(pixels[n], [&](const GatherPoint&) { bare[n] = 1; });
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
    std::size_t next = 0;
    while (next < left.size()) {
      std::vector<Request> requests;
      while (next < left.size() && requests.size() < kBatch) {
        const Pixel& pixel = left[next++];
        std::uint64_t key = pixel.order;
        each_point(pixel, [&](const GatherPoint& point) {
          requests.push_back({point.place, key = mix_bits(key, 1), std::nullopt});
        });
      }
      make(requests, report);
      const double done = static_cast<double>(next) / static_cast<double>(left.size());
      go_on(progress, (rounds + done) / kRounds);
    }
    ++rounds;
    stride = std::max(stride / 2, 1);
  }
}

CachingMethod::Report CachingMethod::update(const GatherPoints& points, const Progress& progress) {
  Report report;
  const auto begin = Clock::now();
  if (!options_.temporal) cache_.clear();
  cache_.begin(now_->number, now_->now->scene);
  if (options_.temporal) replace_old(report);
  fill(points, report, progress);
  report.alive = cache_.alive_count();
  report.update_ms = ms_since(begin);
  return report;
}

// How far records of several ages are from what would be sampled now, and reprojections of what
// they see now from what is sampled in the next frame.
void CachingMethod::check_records(Report& report) const {
  const std::vector<std::uint32_t> alive = cache_.alive();
  const std::size_t count = std::min(alive.size(), static_cast<std::size_t>(options_.check));
  if (count == 0) return;
  const AnimatedFrame next = scene_.at(now_->number + 1);
  const FrameTracer later(next);
  const FrameChange change(*now_->now, next);
  struct Found {
    double off, reprojected, still;
  };
  std::vector<Found> found(count);
  parallel_for(static_cast<int>(count), [&](int number) {
    const auto n = static_cast<std::size_t>(number);
    const CacheRecord& r = cache_.records()[alive[n * alive.size() / count]];
    Hemisphere h = stratified_hemisphere(options_.hemisphere_samples, r.key), then = h;
    std::vector<SeenPlace> seen;
    gather_hemisphere(*now_->tracer, place_in(now_->now->scene, r.place), r.key, h, &seen);
    gather_hemisphere(later, place_in(next.scene, r.place), r.key, then, nullptr);
    const RgbD fresh = record_value(h).irradiance, wanted = record_value(then).irradiance;
    const RgbD shown = r.value.irradiance + r.change.irradiance * (now_->number - r.born);
    found[n] = {difference(shown, fresh),
                difference(record_value(reprojected(h, seen, r.place, change)).irradiance, wanted),
                difference(fresh, wanted)};
  });
  Found sum{};
  for (const Found& f : found) {
    sum.off += f.off, sum.reprojected += f.reprojected, sum.still += f.still;
  }
  const auto mean = [&](double x) { return x / static_cast<double>(count); };
  report.accuracy = 1 - mean(sum.off);
  report.reprojection_error = mean(sum.reprojected), report.still_error = mean(sum.still);
}

FramePicture CachingMethod::gather(const GatherPoints& points) const {
  const FrameTracer& tracer = *now_->tracer;
  const Scene& scene = now_->now->scene;
  FramePicture out;
  out.radiance = points.without;
  Image life(options_.width, options_.height);
  parallel_for(options_.height, [&](int y) {
    const auto& row = points.row[static_cast<std::size_t>(y)];
    const auto& first = points.first[static_cast<std::size_t>(y)];
    for (int x = 0; x < options_.width; ++x) {
      RgbD sum(out.radiance.at(x, y));
      const std::uint64_t key = mix_bits(options_.seed ^ 0x5eed, out.radiance.index(x, y));
      double left = 0, weight = 0;
      for (std::size_t i = first[static_cast<std::size_t>(x)];
           i < first[static_cast<std::size_t>(x) + 1]; ++i) {
        const GatherPoint& point = row[i];
        const SurfaceHit surface =
            surface_at(scene, tracer.visibility(), point.hit, point.direction);
        const Bsdf bsdf = bsdf_at(scene, surface);
        PathRandom random(mix_bits(key, i - first[static_cast<std::size_t>(x)]));
        RgbD radiance = tracer.emitted(surface);
        const int looks = tracer.has_shining() ? options_.direct_samples : 1;
        for (int s = 0; s < looks; ++s) {
          radiance += tracer.direct(surface, bsdf, random, false) * (1.0 / looks);
        }
        if (has_narrow_lobe(bsdf)) {
          radiance += tracer.lobe_light(surface, bsdf, random, options_.glossy_samples);
        }
        if (point.broad) {
          if (const auto found = cache_.at(point.position, point.normal, bsdf.normal)) {
            radiance += broad_reflectance(bsdf) * found->irradiance * (1 / kPi);
            const double w = luminance(point.weight);
            left += found->left * w, weight += w;
          }
        }
        sum += point.weight * radiance;
      }
      out.radiance.at(x, y) = Rgb(sum);
      const auto share =
          weight > 0 ? static_cast<float>(left / weight / options_.age.longest) : 0.0f;
      if (weight > 0) life.at(x, y) = {1 - share, share, 0.1f};
    }
  });
  if (options_.show_life) out.extra.push_back({"life", std::move(life)});
  return out;
}

// Records that outlive the animation get their gradients from its last frame.
void CachingMethod::close_last(Report& report) {
  std::vector<Request> requests;
  for (const std::uint32_t i : cache_.alive()) {
    const CacheRecord& r = cache_.records()[i];
    if (r.born < now_->number && r.last_used == now_->number) {
      requests.push_back({r.place, r.key, i});
    }
  }
  make(requests, report);
}

void CachingMethod::prepare(int first, int count, const Progress& progress) {
  if (!two_passes()) return;
  prepared_.clear(), prepared_first_ = first;
  for (int i = 0; i < count; ++i) {
    const auto share = [&](double s) { return !progress || progress((i + s) / count); };
    go_to(first + i);
    const auto begin = Clock::now();
    const GatherPoints points = gather_points(*now_->tracer, now_->camera);
    Report report = update(points, share);
    // Whom the picture will ask: that alone is wanted here, not the picture.
    parallel_for(options_.height, [&](int y) {
      for (const GatherPoint& p : points.row[static_cast<std::size_t>(y)]) {
        if (p.broad) cache_.at(p.position, p.normal, p.normal);
      }
    });
    cache_.note_use();
    if (i + 1 == count) close_last(report);
    report.update_ms = ms_since(begin) + now_->build_ms;
    prepared_.push_back(report);
  }
  now_.reset();
}

FramePicture CachingMethod::frame(int number, const Progress& progress) {
  go_to(number);
  auto begin = Clock::now();
  const GatherPoints points = gather_points(*now_->tracer, now_->camera);
  double render_ms = ms_since(begin);
  Report report;
  const std::size_t n = static_cast<std::size_t>(number - prepared_first_);
  if (two_passes() && number >= prepared_first_ && n < prepared_.size()) {
    report = prepared_[n];
    cache_.begin(number, now_->now->scene);
  } else {
    report = update(points, progress);
  }
  begin = Clock::now();
  FramePicture out = gather(points);
  render_ms += ms_since(begin);
  if (!two_passes()) cache_.note_use();
  if (options_.check > 0) check_records(report);
  out.figure = {static_cast<double>(report.made),
                static_cast<double>(report.replaced),
                static_cast<double>(report.alive),
                report.rays,
                now_->build_ms,
                report.update_ms,
                report.hemisphere_ms,
                report.reproject_ms,
                render_ms};
  if (options_.check > 0) {
    for (const double x : {report.accuracy, report.reprojection_error, report.still_error}) {
      out.figure.push_back(x);
    }
  }
  go_on(progress, 1);
  return out;
}

}  // namespace haarlight
