// What ends an update other than a number of wavelets: time, or an error that is small enough.

#pragma once

#include <span>

#include "core/rgb.h"
#include "prt/lighting_update.h"

namespace haarlight {

/// Asked by LightingTracker while it decides, wavelet by wavelet, in the order of their ranks.
class UpdateLimit {
 public:
  virtual ~UpdateLimit() = default;
  /// Of the bands that PBI would reset, those that are reset; the others go on incrementally.
  /// `gain` of each is the weighted L1 norm of what is to be approximated that the reset saves.
  virtual BandMask allow(const BandMask& wanted, std::span<const double> gain) {
    static_cast<void>(gain);
    return wanted;
  }
  /// The bands to reset are chosen; `shown` is what is left without them. Both lightings are valid
  /// until the update is decided.
  virtual void begin(std::span<const Rgb> target, std::span<const Rgb> shown,
                     const BandMask& reset) = 0;
  /// Whether the next wavelet is to be changed, by `difference`; after a no it is not asked again,
  /// unless by LightingTracker::extend().
  virtual bool take(int index, const Rgb& difference) = 0;
};

}  // namespace haarlight
