// The motions of the light by which methods are compared.

#include "prt/motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "prt/disc_light.h"

namespace haarlight {
namespace {

struct KindName {
  MotionKind kind;
  std::string_view name;
};
constexpr std::array<KindName, 6> kNames = {{{MotionKind::still, "still"},
                                             {MotionKind::rotate, "rotate"},
                                             {MotionKind::tumble, "tumble"},
                                             {MotionKind::swing, "swing"},
                                             {MotionKind::blend, "blend"},
                                             {MotionKind::light, "light"}}};

constexpr Vec3 kDiscAxis = {0.6, 0.64, 0.48};
constexpr double kDiscFromAxis = kPi / 6;

int effective_frame(const MotionOptions& options, int frame) {
  if (frame < 0) {
    throw Error(ErrorKind::invalid_argument, fmt::format("frame is {}, expected 0 or more", frame));
  }
  return options.kind == MotionKind::still ? 0 : std::min(frame, options.stop);
}

double time_of(const MotionOptions& options, int frame) {
  return static_cast<double>(effective_frame(options, frame)) / options.stop;
}

void check(const MotionOptions& options) {
  if (options.stop < 1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("stop is frame {}, expected at least 1", options.stop));
  }
  if (!std::isfinite(options.degrees)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("degrees is {}, expected a finite number", options.degrees));
  }
}

}  // namespace

std::optional<MotionKind> motion_from_name(std::string_view name) {
  for (const KindName& known : kNames) {
    if (known.name == name) return known.kind;
  }
  return std::nullopt;
}

std::string motion_name(MotionKind kind) {
  for (const KindName& known : kNames) {
    if (known.kind == kind) return std::string(known.name);
  }
  return "unknown";
}

Rotation motion_rotation(const MotionOptions& options, int frame) {
  check(options);
  const double t = time_of(options, frame), radians = options.degrees * kPi / 180;
  switch (options.kind) {
    case MotionKind::rotate:
      return rotation_y(radians * t * t);
    case MotionKind::tumble:
      return rotation_x(1.6 * radians * t * t) * rotation_y(2 * radians * t);
    case MotionKind::swing:
      return rotation_y(0.4 * radians * std::sin(4 * kPi * t));
    case MotionKind::still:
    case MotionKind::blend:
    case MotionKind::light:
      break;
  }
  return {};
}

Vec3 motion_disc_center(const MotionOptions& options, int frame) {
  check(options);
  const Vec3 up{0, 1, 0};
  const Vec3 above = normalize(up - kDiscAxis * dot(up, kDiscAxis));
  const Vec3 side = cross(kDiscAxis, above);
  const double angle = 2 * kPi * time_of(options, frame);
  return normalize(kDiscAxis * std::cos(kDiscFromAxis) +
                   (above * std::cos(angle) + side * std::sin(angle)) * std::sin(kDiscFromAxis));
}

Motion::Motion(const MotionOptions& options, const HaarLayout& layout, const Environment& from,
               const Environment* to)
    : options_(options),
      layout_(layout),
      from_(from, layout.face_size()),
      current_(layout.face_size()),
      start_(layout.face_size()),
      other_(layout.face_size()),
      coefficients_(static_cast<std::size_t>(layout.size())) {
  check(options_);
  from_.project({}, start_);
  if (options_.kind == MotionKind::blend) {
    if (to == nullptr) {
      throw Error(ErrorKind::invalid_argument,
                  "blend has one environment, expected a second one to blend to");
    }
    EnvironmentSampler(*to, layout.face_size()).project({}, other_);
  }
}

const Cubemap& Motion::cubemap(int frame) {
  const int wanted = effective_frame(options_, frame);
  if (wanted == frame_) return current_;
  switch (options_.kind) {
    case MotionKind::still:
      current_ = start_;
      break;
    case MotionKind::rotate:
    case MotionKind::tumble:
    case MotionKind::swing:
      from_.project(motion_rotation(options_, wanted), current_);
      break;
    case MotionKind::blend: {
      const auto t = static_cast<float>(time_of(options_, wanted));
      std::transform(start_.texels.begin(), start_.texels.end(), other_.texels.begin(),
                     current_.texels.begin(),
                     [t](const Rgb& a, const Rgb& b) { return (1 - t) * a + t * b; });
      break;
    }
    case MotionKind::light:
      std::transform(start_.texels.begin(), start_.texels.end(), current_.texels.begin(),
                     [](const Rgb& a) { return static_cast<float>(kDiscBackgroundShare) * a; });
      add_disc_light(motion_disc_center(options_, wanted), kDiscCosine,
                     Rgb(kDiscRadiance, kDiscRadiance, kDiscRadiance), current_);
      break;
  }
  frame_ = wanted;
  transformed_ = false;
  return current_;
}

std::span<const Rgb> Motion::coefficients(int frame) {
  cubemap(frame);
  if (!transformed_) {
    haar_forward(layout_, current_.texels, coefficients_);
    transformed_ = true;
  }
  return coefficients_;
}

}  // namespace haarlight
