// The light of the next frame by what was seen in this one: Gautron and others 2007, section 4.7.

#pragma once

#include <vector>

#include "caching/animated_scene.h"
#include "caching/hemisphere.h"

namespace haarlight {

/// What is different in the next frame. Both frames must outlive it.
class FrameChange {
 public:
  FrameChange(const AnimatedFrame& now, const AnimatedFrame& next);

  const AnimatedFrame& now() const { return now_; }
  const AnimatedFrame& next() const { return next_; }
  bool moves(std::uint32_t triangle) const { return moves_[triangle]; }
  bool recolors(std::uint32_t triangle) const;
  bool lights_change() const { return lights_change_; }
  /// Of all lamps and shining triangles together, a channel at a time; 1 for what was dark.
  const RgbD& power_ratio() const { return power_ratio_; }

 private:
  const AnimatedFrame& now_;
  const AnimatedFrame& next_;
  std::vector<bool> moves_;
  bool lights_change_ = false;
  RgbD power_ratio_{1, 1, 1};
};

/// Counts of what a reprojection did.
struct ReprojectionReport {
  int moved = 0;    ///< strata whose light is now in another place or of another strength
  int covered = 0;  ///< parts of strata that fell behind nearer ones
  int holes = 0;    ///< strata that were not covered all over
};

/// Estimates `now` (gathered at `place`, which saw `seen`) as it will be in the next frame, without
/// a ray: every place seen is carried along by its body and takes its whole stratum with it, which
/// then covers parts of up to four. The nearest parts hide the others, and what is left of a
/// stratum gets the light of its deepest neighbour. So a step of a tenth of a stratum changes a
/// tenth of it: single samples that hop across borders would be taken for changes of light. Lamps
/// are looked at anew from where places and lamps will be, hidden where they are hidden now; the
/// rest goes with the power of all lights, and all of it with the material's colour. The same bits
/// as `now` where nothing changes.
Hemisphere reprojected(const Hemisphere& now, const std::vector<SeenPlace>& seen,
                       const BodyPlace& place, const FrameChange& change,
                       ReprojectionReport* report = nullptr);

}  // namespace haarlight
