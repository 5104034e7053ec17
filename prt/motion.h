// The motions of the light by which methods are compared.

#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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
  light,   ///< a white disc light (cosine of half-angle 0.97, radiance 50) added to 2 % of A. Its
          ///< middle goes once round the direction (0.6, 0.64, 0.48), right-handed, 30 degrees from
          ///< it, starting on the side of +Y
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

/// The disc of `light`: white radiance inside a cone, and what is left of A behind it.
inline constexpr double kDiscRadiance = 50;           ///< W m^-2 sr^-1
inline constexpr double kDiscCosine = 0.97;           ///< of the cone's half-angle
inline constexpr double kDiscBackgroundShare = 0.02;  ///< of A

/// Unit direction of the disc's middle in a frame. Requires frame >= 0.
Vec3 motion_disc_center(const MotionOptions& options, int frame);

/// Target lighting frame by frame.
class Motion {
 public:
  /// `to` is the B of blend and must be there for it. Throws Error{invalid_argument} for options
  /// out of range or a blend without `to`. Keeps copies; the environments need not outlive it.
  Motion(const MotionOptions& options, const HaarLayout& layout, const Environment& from,
         const Environment* to = nullptr);

  const MotionOptions& options() const { return options_; }

  /// Radiance on the cube map of a frame >= 0, texel averages; valid until the next call.
  const Cubemap& cubemap(int frame);

  /// The same as Haar coefficients, layout.size() of them; valid until the next call. Frames at and
  /// after `stop` give the same bits.
  std::span<const Rgb> coefficients(int frame);

 private:
  MotionOptions options_;
  HaarLayout layout_;
  EnvironmentSampler from_;
  Cubemap current_, start_, other_;  // of the frame; of A and of B as they stand
  std::vector<Rgb> coefficients_;
  int frame_ = -1;            // the frame, at most stop, that current_ shows
  bool transformed_ = false;  // coefficients_ belong to current_
};

}  // namespace haarlight
