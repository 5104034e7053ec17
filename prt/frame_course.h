// How a frame under a time went, so that it can be gone again.

#pragma once

#include <algorithm>

#include "prt/update_limit.h"

namespace haarlight {

/// What the clock decided of a frame, beside the number of its wavelets. Of other frames, nothing.
struct FrameCourse {
  bool timed = false;  ///< it was under a time
  int first = 0;       ///< of two parts, the wavelets of the first; 0: the update came in one part
  BandMask put_off;    ///< bands that PBI would have reset, for which there was no time
  bool operator==(const FrameCourse&) const = default;
};

/// Ends the parts of an update where those of another frame ended.
class CourseLimit final : public UpdateLimit {
 public:
  /// `wavelets` >= 1, of the whole frame.
  CourseLimit(const FrameCourse& course, int wavelets)
      : course_(course),
        left_(course.first > 0 ? std::min(course.first, wavelets) : wavelets),
        rest_(wavelets - left_) {}

  /// The second part is asked for.
  void resume() { left_ = rest_; }

  BandMask allow(const BandMask& wanted, std::span<const double>) override {
    return wanted & ~course_.put_off;
  }
  void begin(std::span<const Rgb>, std::span<const Rgb>, const BandMask&) override {}
  bool take(int, const Rgb&) override { return left_ > 0 && left_-- > 0; }

 private:
  FrameCourse course_;
  int left_, rest_;
};

}  // namespace haarlight
