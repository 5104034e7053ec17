// Caching methods: frames, passes and pictures.

#include "caching/caching_method.h"

#include <algorithm>
#include <chrono>
#include <set>

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

}  // namespace

struct CachingMethod::Update {
  RecordReport report;
  double ms = 0;  // by the clock
};

CachingMethod::CachingMethod(const AnimatedScene& scene, const CachingOptions& options)
    : scene_(scene), options_(options), irradiance_(options), radiance_(options) {
  const auto wanted = [](bool right, const char* what) {
    if (!right) throw Error(ErrorKind::invalid_argument, what);
  };
  wanted(options.accuracy > 0 && options.accuracy <= 1, "accuracy of records, expected (0, 1]");
  wanted(options.least_spacing > 0 && options.least_spacing <= options.most_spacing,
         "spacing of records, expected 0 < least <= most pixels");
  wanted(options.hemisphere_samples >= 1, "samples of a hemisphere, expected at least 1");
  wanted(options.age.accuracy > 0 && options.age.longest >= 1,
         "age of records, expected an accuracy above 0 and at least 1 frame");
}

CachingMethod::~CachingMethod() = default;

bool CachingMethod::two_passes() const {
  return options_.temporal && options_.gradients == TemporalGradients::interpolated;
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
  auto to = std::make_unique<CachedFrame>();
  to->number = number, to->lobes = &lobes_;
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

GatherPoints CachingMethod::look() {
  GatherPoints points = gather_points(*now_->tracer, now_->camera);
  std::set<std::int32_t> lobes;
  for (const auto& row : points.row) {
    for (const GatherPoint& p : row) {
      if (p.glossy) lobes.insert(p.lobe);
    }
  }
  lobes_.make({lobes.begin(), lobes.end()});
  return points;
}

CachingMethod::Update CachingMethod::update(const GatherPoints& points, const Progress& progress) {
  Update done;
  const auto begin = Clock::now();
  irradiance_.begin(*now_), radiance_.begin(*now_);
  const auto half = [&](double from) {
    return [&, from](double share) { return !progress || progress(from + share / 2); };
  };
  irradiance_.update(*now_, points, done.report, half(0));
  radiance_.update(*now_, points, done.report, half(0.5));
  done.ms = ms_since(begin);
  return done;
}

void CachingMethod::note_use() { irradiance_.cache().note_use(), radiance_.cache().note_use(); }

// `left`: for how many frames the records it is lit by are good, -1 if there are none.
RgbD CachingMethod::radiance_of(const GatherPoint& point, PathRandom& random, double& left) const {
  const FrameTracer& tracer = *now_->tracer;
  const Scene& scene = now_->now->scene;
  const SurfaceHit surface = surface_at(scene, tracer.visibility(), point.hit, point.direction);
  const Bsdf bsdf = bsdf_at(scene, surface);
  RgbD radiance = tracer.emitted(surface);
  const int looks = tracer.has_shining() ? options_.direct_samples : 1;
  for (int s = 0; s < looks; ++s) {
    radiance += tracer.direct(surface, bsdf, random, false) * (1.0 / looks);
  }
  left = -1;
  if (lobe_kind(bsdf) == LobeKind::narrow) {
    radiance += tracer.lobe_light(surface, bsdf, random, options_.glossy_samples);
  }
  if (point.glossy) {
    RgbD sum;
    double weights = 0;
    left = radiance_.cache().visit(
        point.position, point.normal,
        [&](const PlaceFrame& at, const RadianceValue& value, double w) {
          sum += lobe_radiance(at, value, point.position, bsdf, point.lobe, lobes_) * w;
          weights += w;
        });
    if (weights > 0) radiance += sum * (1 / weights);
  }
  if (point.broad) {
    const FoundIrradiance found =
        irradiance_at(irradiance_.cache(), point.position, point.normal, bsdf.normal);
    radiance += broad_reflectance(bsdf) * found.irradiance * (1 / kPi);
    left = left < 0 ? found.left : std::min(left, found.left);
  }
  return radiance;
}

FramePicture CachingMethod::gather(const GatherPoints& points) const {
  FramePicture out;
  out.radiance = points.without;
  Image life(options_.width, options_.height);
  parallel_for(options_.height, [&](int y) {
    const auto& row = points.row[static_cast<std::size_t>(y)];
    const auto& first = points.first[static_cast<std::size_t>(y)];
    for (int x = 0; x < options_.width; ++x) {
      RgbD sum(out.radiance.at(x, y));
      const std::uint64_t key = mix_bits(options_.seed ^ 0x5eed, out.radiance.index(x, y));
      const std::size_t begin = first[static_cast<std::size_t>(x)];
      double lives = 0, weights = 0;
      for (std::size_t i = begin; i < first[static_cast<std::size_t>(x) + 1]; ++i) {
        PathRandom random(mix_bits(key, i - begin));
        double left = -1;
        sum += row[i].weight * radiance_of(row[i], random, left);
        const double w = left < 0 ? 0 : luminance(row[i].weight);
        lives += w * left, weights += w;
      }
      out.radiance.at(x, y) = Rgb(sum);
      if (!(weights > 0)) continue;
      const auto share = static_cast<float>(lives / weights / options_.age.longest);
      life.at(x, y) = {1 - share, share, 0.1f};
    }
  });
  if (options_.show_life) out.extra.push_back({"life", std::move(life)});
  return out;
}

void CachingMethod::prepare(int first, int count, const Progress& progress) {
  if (!two_passes()) return;
  prepared_.clear(), prepared_first_ = first;
  for (int i = 0; i < count; ++i) {
    const auto share = [&](double s) { return !progress || progress((i + s) / count); };
    go_to(first + i);
    const auto begin = Clock::now();
    const GatherPoints points = look();
    Update done = update(points, share);
    // Whom the picture will ask: that alone is wanted here, not the picture.
    parallel_for(options_.height, [&](int y) {
      for (const GatherPoint& p : points.row[static_cast<std::size_t>(y)]) {
        if (p.broad) irradiance_.cache().visit(p.position, p.normal, [](auto&&...) {});
        if (p.glossy) radiance_.cache().visit(p.position, p.normal, [](auto&&...) {});
      }
    });
    note_use();
    if (i + 1 == count) {
      irradiance_.close(*now_, done.report), radiance_.close(*now_, done.report);
    }
    done.ms = ms_since(begin) + now_->build_ms;
    prepared_.push_back(done);
  }
  now_.reset();
}

FramePicture CachingMethod::frame(int number, const Progress& progress) {
  go_to(number);
  auto begin = Clock::now();
  const GatherPoints points = look();
  double render_ms = ms_since(begin);
  Update done;
  const auto n = static_cast<std::size_t>(number - prepared_first_);
  if (two_passes() && number >= prepared_first_ && n < prepared_.size()) {
    done = prepared_[n];
    irradiance_.begin(*now_), radiance_.begin(*now_);
  } else {
    done = update(points, progress);
  }
  begin = Clock::now();
  FramePicture out = gather(points);
  render_ms += ms_since(begin);
  if (!two_passes()) note_use();
  const RecordReport& r = done.report;
  out.figure = {static_cast<double>(r.made),
                static_cast<double>(r.replaced),
                static_cast<double>(r.alive),
                r.rays,
                now_->build_ms,
                done.ms,
                r.hemisphere_ms,
                r.reproject_ms,
                render_ms};
  if (options_.check > 0) {
    const AnimatedFrame next = scene_.at(number + 1);
    const FrameTracer later(next);
    RecordReport checked;
    irradiance_.check(*now_, later, checked), radiance_.check(*now_, later, checked);
    const auto count = static_cast<double>(std::max<std::size_t>(checked.checked, 1));
    out.figure.push_back(1 - checked.off / count);
    out.figure.push_back(checked.reprojection_error / count);
    out.figure.push_back(checked.still_error / count);
  }
  if (progress && !progress(1)) throw Error(ErrorKind::cancelled, "stopped");
  return out;
}

}  // namespace haarlight
