// Draws the moving light behind the scene.

#include "prt/motion_background.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/image_relighter.h"

namespace haarlight {
namespace {

constexpr int kDiscSamples = 4;  // on an axis of a pixel, for a smooth rim

/// composite_environment of `environment` times `factor`. What that adds is linear in radiance, so
/// that lights can be drawn one after the other.
void add_environment(const SceneView& view, const Environment& environment,
                     const Rotation& rotation, double factor, Image& picture) {
  if (factor <= 0) return;
  if (factor == 1) {
    composite_environment(view, environment, rotation, picture);
    return;
  }
  const EnvironmentOptions options{.projection = environment.projection(), .scale = factor};
  composite_environment(view, Environment(environment.picture(), options), rotation, picture);
}

void add_disc(const SceneView& view, const Vec3& center, double cosine, const Rgb& radiance,
              Image& picture) {
  parallel_for(picture.height, [&](int y) {
    for (int x = 0; x < picture.width; ++x) {
      int inside = 0;
      for (int j = 0; j < kDiscSamples; ++j) {
        for (int i = 0; i < kDiscSamples; ++i) {
          const Vec3 direction =
              view.camera.direction(x + (i + 0.5) / kDiscSamples, y + (j + 0.5) / kDiscSamples);
          inside += dot(direction, center) >= cosine;
        }
      }
      const double share = static_cast<double>(inside) / (kDiscSamples * kDiscSamples);
      const float uncovered = 1 - view.coverage[picture.index(x, y)];
      picture.at(x, y) += Rgb(RgbD(radiance) * share) * uncovered;
    }
  });
}

void check_size(const SceneView& view, const Image& picture) {
  const Camera& camera = view.camera;
  if (picture.width != camera.width || picture.height != camera.height ||
      view.coverage.size() != picture.pixels.size()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture is {}x{}, expected {}x{} as the view, with a coverage of {} "
                            "pixels",
                            picture.width, picture.height, camera.width, camera.height,
                            view.coverage.size()));
  }
}

}  // namespace

void composite_motion_background(const SceneView& view, const MotionOptions& options, int frame,
                                 const Environment& from, const Environment* to, Image& picture) {
  check_size(view, picture);
  switch (options.kind) {
    case MotionKind::blend: {
      if (to == nullptr) {
        throw Error(ErrorKind::invalid_argument,
                    "blend has one environment, expected a second one to blend to");
      }
      const double t = static_cast<double>(std::min(frame, options.stop)) / options.stop;
      add_environment(view, from, {}, 1 - t, picture);
      add_environment(view, *to, {}, t, picture);
      break;
    }
    case MotionKind::light:
      add_environment(view, from, {}, kDiscBackgroundShare, picture);
      add_disc(view, motion_disc_center(options, frame), kDiscCosine,
               Rgb(kDiscRadiance, kDiscRadiance, kDiscRadiance), picture);
      break;
    case MotionKind::still:
    case MotionKind::rotate:
    case MotionKind::tumble:
    case MotionKind::swing:
      composite_environment(view, from, motion_rotation(options, frame), picture);
      break;
  }
}

void composite_light_background(const SceneView& view, const LightState& state,
                                std::span<const Environment> environments, Image& picture) {
  check_size(view, picture);
  check_light_state(state, environments.size());
  const auto draw = [&](int index, double factor) {
    if (factor <= 0) return;
    add_environment(view, environments[static_cast<std::size_t>(index)], state.rotation, factor,
                    picture);
  };
  draw(state.from, (1 - state.blend) * state.background);
  draw(state.to, state.blend * state.background);
  for (const DiscLight& disc : state.discs) {
    add_disc(view, disc.direction, std::cos(disc.half_angle), disc.radiance, picture);
  }
}

}  // namespace haarlight
