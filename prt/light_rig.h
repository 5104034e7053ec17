// Light made of turned and blended environments and discs: one value says all of it.

#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "prt/disc_light.h"
#include "wavelet/environment.h"
#include "wavelet/haar.h"

namespace haarlight {

/// The light of a frame: background * ((1 - blend) from + blend to), turned by `rotation`, plus the
/// discs, which stand still in the world.
struct LightState {
  int from = 0, to = 0;   ///< which of the rig's environments
  double blend = 0;       ///< [0, 1]
  double background = 1;  ///< [0, 1e6]
  Rotation rotation;      ///< light that came from direction d comes from rotation * d
  std::vector<DiscLight> discs;
};
bool operator==(const LightState& a, const LightState& b);

/// Throws Error{invalid_argument} naming what is out of range; `environments` is how many there
/// are.
void check_light_state(const LightState& state, std::size_t environments);

/// Turns light states into coefficients; the same state gives the same bits.
class LightRig {
 public:
  explicit LightRig(const HaarLayout& layout);

  /// Puts an environment in place `slot` (at most environments()); it need not outlive the rig.
  void set_environment(std::size_t slot, const Environment& environment);
  std::size_t environments() const { return samplers_.size(); }

  /// Radiance on the cube map, texel averages; valid until the next call. What did not change since
  /// the call before is not worked out again. Throws as check_light_state does. No heap use once
  /// warm.
  const Cubemap& cubemap(const LightState& state);

  /// The same as Haar coefficients, layout.size() of them; valid until the next call.
  std::span<const Rgb> coefficients(const LightState& state);

 private:
  /// An environment as it stands in `map`.
  struct Turned {
    Cubemap map;
    int environment = -1;
    Rotation rotation;
  };
  const Cubemap& turned(Turned& memory, int environment, const Rotation& rotation);

  HaarLayout layout_;
  std::vector<EnvironmentSampler> samplers_;
  Turned from_, to_;
  Cubemap current_;
  std::vector<Rgb> coefficients_;
  std::optional<LightState> state_;  // that current_ and coefficients_ belong to
  bool transformed_ = false;
};

}  // namespace haarlight
