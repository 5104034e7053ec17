// Turns, blends and adds light.

#include "prt/light_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace haarlight {
namespace {

constexpr double kMaxBackground = 1e6;

bool same(const Rotation& a, const Rotation& b) { return a.row == b.row; }

void check_environment(int index, std::size_t count, const char* which) {
  if (index >= 0 && static_cast<std::size_t>(index) < count) return;
  throw Error(ErrorKind::invalid_argument,
              fmt::format("{} is environment {}, expected one of {}", which, index, count));
}

}  // namespace

bool operator==(const LightState& a, const LightState& b) {
  return a.from == b.from && a.to == b.to && a.blend == b.blend && a.background == b.background &&
         same(a.rotation, b.rotation) && a.discs == b.discs;
}

void check_light_state(const LightState& state, std::size_t environments) {
  check_environment(state.from, environments, "from");
  if (state.blend > 0) check_environment(state.to, environments, "to");
  if (!(state.blend >= 0 && state.blend <= 1)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("blend is {}, expected 0 to 1", state.blend));
  }
  if (!(state.background >= 0 && state.background <= kMaxBackground)) {
    throw Error(ErrorKind::invalid_argument, fmt::format("background is {}, expected 0 to {}",
                                                         state.background, kMaxBackground));
  }
  // Rounded to nine digits, a rotation is still within this.
  const Rotation square = state.rotation * state.rotation.transposed(), one;
  const Vec3 right_handed = cross(state.rotation.row[0], state.rotation.row[1]);
  double off = length(right_handed - state.rotation.row[2]);
  for (std::size_t i = 0; i < 3; ++i) off = std::max(off, length(square.row[i] - one.row[i]));
  if (!(off <= 1e-8)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("rotation is {:.3g} away from one, expected orthonormal rows, "
                            "right-handed",
                            off));
  }
  for (const DiscLight& disc : state.discs) check_disc_light(disc);
}

LightRig::LightRig(const HaarLayout& layout)
    : layout_(layout),
      from_{Cubemap(layout.face_size()), -1, {}},
      to_{Cubemap(layout.face_size()), -1, {}},
      current_(layout.face_size()),
      coefficients_(static_cast<std::size_t>(layout.size())) {}

void LightRig::set_environment(std::size_t slot, const Environment& environment) {
  if (slot > samplers_.size()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("slot is {}, expected at most {}", slot, samplers_.size()));
  }
  EnvironmentSampler sampler(environment, layout_.face_size());
  if (slot == samplers_.size()) {
    samplers_.push_back(std::move(sampler));
  } else {
    samplers_[slot] = std::move(sampler);
  }
  from_.environment = to_.environment = -1;
  state_.reset();
}

const Cubemap& LightRig::turned(Turned& memory, int environment, const Rotation& rotation) {
  if (memory.environment != environment || !same(memory.rotation, rotation)) {
    samplers_[static_cast<std::size_t>(environment)].project(rotation, memory.map);
    memory.environment = environment;
    memory.rotation = rotation;
  }
  return memory.map;
}

const Cubemap& LightRig::cubemap(const LightState& state) {
  if (state_ && *state_ == state) return current_;
  check_light_state(state, samplers_.size());

  // With one environment at its own strength no number is touched, so that a rig gives the bits of
  // a plain motion.
  const auto scale = [&](float factor, const Cubemap& map) {
    std::transform(map.texels.begin(), map.texels.end(), current_.texels.begin(),
                   [factor](const Rgb& c) { return factor * c; });
  };
  const auto background = static_cast<float>(state.background);
  const auto t = static_cast<float>(state.blend);
  if (t > 0 && t < 1) {
    const Cubemap& a = turned(from_, state.from, state.rotation);
    const Cubemap& b = turned(to_, state.to, state.rotation);
    std::transform(a.texels.begin(), a.texels.end(), b.texels.begin(), current_.texels.begin(),
                   [t](const Rgb& x, const Rgb& y) { return (1 - t) * x + t * y; });
    if (background != 1) scale(background, current_);
  } else {
    const Cubemap& map =
        t > 0 ? turned(to_, state.to, state.rotation) : turned(from_, state.from, state.rotation);
    if (background != 1) {
      scale(background, map);
    } else {
      current_.texels = map.texels;
    }
  }
  for (const DiscLight& disc : state.discs) add_disc_light(disc, current_);

  state_ = state;
  transformed_ = false;
  return current_;
}

std::span<const Rgb> LightRig::coefficients(const LightState& state) {
  cubemap(state);
  if (!transformed_) {
    haar_forward(layout_, current_.texels, coefficients_);
    transformed_ = true;
  }
  return coefficients_;
}

}  // namespace haarlight
