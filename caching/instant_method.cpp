// Pictures by virtual lights.

#include "caching/instant_method.h"

#include <chrono>
#include <utility>

#include "caching/path_picture.h"
#include "core/error.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

// Milliseconds since the last look.
class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }
  double so_far() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - last_)
        .count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

InstantMethod::InstantMethod(const AnimatedScene& scene, const InstantOptions& options)
    : scene_(scene), options_(options), visibility_(scene), cache_(options.cache) {}

std::vector<std::string> InstantMethod::figures() const {
  return {"build_ms",    "direct_ms",       "lights_ms",       "update_ms",       "gather_ms",
          "diffuse_ms",  "total_ms",        "lights",          "lights_changed",  "records",
          "records_new", "records_dropped", "records_carried", "records_updated", "rays",
          "rays_moving", "rays_saved",      "bounded"};
}

FramePicture InstantMethod::frame(int number, const Progress& progress) {
  const Stopwatch watch;
  AnimatedFrame frame = scene_.at(number);
  const double read_ms = watch.so_far();
  FramePicture out = draw(std::move(frame), progress);
  // build_ms and total_ms.
  out.figure[0] += read_ms, out.figure[6] += read_ms;
  return out;
}

// Red where all light was looked at in this frame, green where it has been good for kLong.
Image InstantMethod::life() const {
  constexpr int kLong = 16;
  std::vector<std::vector<float>> frames;
  cache_.kept_for(rows_, kLong, frames);
  Image life(options_.width, options_.height);
  for (int y = 0; y < options_.height; ++y) {
    const SurfaceRow& row = rows_[static_cast<std::size_t>(y)];
    for (int x = 0; x < options_.width; ++x) {
      const auto at = static_cast<std::size_t>(x);
      double sum = 0, weights = 0;
      for (std::size_t i = row.first[at]; i < row.first[at + 1]; ++i) {
        const auto kept = static_cast<double>(frames[static_cast<std::size_t>(y)][i]);
        const double w = kept < 0 ? 0 : luminance(row.point[i].weight);
        sum += w * kept, weights += w;
      }
      if (!(weights > 0)) continue;
      const auto share = static_cast<float>(sum / weights / kLong);
      life.at(x, y) = {1 - share, share, 0.1f};
    }
  }
  return life;
}

FramePicture InstantMethod::draw(AnimatedFrame next, const Progress& progress) {
  const auto stop_if_told = [&](double share) {
    if (progress && !progress(share)) throw Error(ErrorKind::cancelled, "stopped");
  };
  Stopwatch watch;
  visibility_.next(std::move(next));
  const AnimatedFrame& frame = visibility_.frame();
  const Camera camera = frame_camera(frame, options_.width, options_.height);
  if (visibility_.extent() != extent_) {
    extent_ = visibility_.extent();
    InstantCacheOptions lengths = options_.cache;
    lengths.least_distance = options_.least_distance * extent_;
    lengths.unit = options_.unit * extent_;
    cache_ = InstantCache(lengths);
  }
  const double build_ms = watch.lap();

  FramePicture out;
  surface_points(visibility_, camera, options_.points, out.radiance, rows_,
                 [&](int rows) { stop_if_told(0.5 * rows / camera.height); });
  const double direct_ms = watch.lap();

  InstantCacheReport report;
  double lights_ms = 0, update_ms = 0, bounded = 0;
  std::size_t lit = 0;
  if (options_.kind != InstantKind::direct) {
    std::vector<VirtualLight> lights = virtual_lights(visibility_, options_.lights);
    for (const VirtualLight& light : lights) lit += light.kind != VirtualLight::Kind::none;
    lights_ms = watch.lap();
    if (options_.kind == InstantKind::igi) {
      report.lights_changed = static_cast<std::int64_t>(lights.size());
      report.rays_whole = interleaved_gather(
          visibility_, lights, rows_,
          {options_.pattern, options_.least_distance * extent_, 0.1 * extent_}, irradiance_);
    } else {
      if (options_.kind == InstantKind::tic || cache_.is_of(visibility_, lights)) {
        cache_.update(visibility_, std::move(lights), report);
      } else {
        cache_.start_anew(visibility_, std::move(lights), report);
      }
      update_ms = watch.lap();
      stop_if_told(0.6);
      cache_.gather(visibility_, rows_, irradiance_, report);
      stop_if_told(0.9);
    }
    parallel_for(camera.height, [&](int y) {
      const SurfaceRow& row = rows_[static_cast<std::size_t>(y)];
      for (int x = 0; x < camera.width; ++x) {
        RgbD sum;
        const auto at = static_cast<std::size_t>(x);
        for (std::size_t i = row.first[at]; i < row.first[at + 1]; ++i) {
          sum += row.point[i].weight * irradiance_[static_cast<std::size_t>(y)][i];
        }
        out.radiance.at(x, y) += Rgb(sum);
      }
    });
  }
  const double gather_ms = watch.lap();
  const bool records = options_.kind == InstantKind::ic || options_.kind == InstantKind::tic;
  if (options_.show_life && records) out.extra.push_back({"life", life()});
  std::size_t alive = 0;
  for (const InstantCache::Record& record : cache_.records()) {
    if (record.alive) bounded += record.lost, ++alive;
  }
  if (alive > 0) bounded /= static_cast<double>(alive);
  const double diffuse_ms = lights_ms + update_ms + gather_ms;
  const auto whole = [](auto n) { return static_cast<double>(n); };
  out.figure = {build_ms,
                direct_ms,
                lights_ms,
                update_ms,
                gather_ms,
                diffuse_ms,
                build_ms + direct_ms + diffuse_ms,
                whole(lit),
                whole(report.lights_changed),
                whole(cache_.alive()),
                whole(report.records_new),
                whole(report.records_dropped),
                whole(report.records_carried),
                whole(report.records_updated),
                whole(report.rays_whole),
                whole(report.rays_moving),
                whole(report.rays_saved),
                bounded};
  return out;
}

}  // namespace haarlight
