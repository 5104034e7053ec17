// The motions of the light by which methods are compared.

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/vec.h"
#include "wavelet/environment.h"
#include "wavelet/haar.h"

namespace haarlight {

/// t below is min(frame, stop) / stop.
enum class MotionKind {
  still,   ///< frame 0 for ever
  rotate,  ///< about +Y by degrees * t^2: slow, fast, stop
  tumble,  ///< about +Y by 2 degrees * t, then about +X by 1.6 degrees * t^2
  swing,   ///< about +Y by 0.4 degrees * sin(4 pi t)
  blend,   ///< (1 - t) A + t B
  light,   ///< a disc light (cosine of half-angle 0.97, radiance 50) carried once round the
           ///< direction (0.6, 0.64, 0.48) over 2 % of A
};

struct MotionOptions {
  MotionKind kind = MotionKind::rotate;
  double degrees = 90;  ///< finite
  int stop = 99;        ///< frame at which the light comes to rest; >= 1
};

std::optional<MotionKind> motion_from_name(std::string_view name);
std::string motion_name(MotionKind kind);

/// Rotation of the environment in a frame (identity for still, blend and light). Built from angles
/// every time. Requires frame >= 0.
Rotation motion_rotation(const MotionOptions& options, int frame);

/// Target lighting frame by frame.
class Motion {
 public:
  /// `to` is the B of blend and must be there for it. Throws Error{invalid_argument} for options
  /// out of range or a blend without `to`. Keeps copies; the environments need not outlive it.
  Motion(const MotionOptions& options, const HaarLayout& layout, const Environment& from,
         const Environment* to = nullptr);

  const MotionOptions& options() const { return options_; }

  /// Radiance on the cube map of a frame, texel averages.
  const Cubemap& cubemap(int frame);

  /// The same as Haar coefficients, layout.size() of them; valid until the next call. Frames at and
  /// after `stop` give the same bits.
  std::span<const Rgb> coefficients(int frame);

 private:
  MotionOptions options_;
  HaarLayout layout_;
  EnvironmentSampler from_;
  std::optional<EnvironmentSampler> to_;
  Cubemap current_, start_, other_;
  std::vector<Rgb> coefficients_;
  int frame_ = -1;
};

}  // namespace haarlight
