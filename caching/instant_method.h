// Pictures by virtual lights: instant global illumination, instant caching, temporal instant
// caching.

#pragma once

#include <vector>

#include "caching/animation_method.h"
#include "caching/instant_cache.h"
#include "caching/interleaved_gather.h"
#include "caching/surface_points.h"

namespace haarlight {

enum class InstantKind {
  direct,  ///< no indirect light: what all of them begin with
  igi,     ///< interleaved sampling and a discontinuity buffer, anew each frame
  ic,      ///< a new cache each frame
  tic      ///< a cache that goes on from frame to frame
};

/// Lengths are shares of half the longest edge of the first frame's bounding box.
struct InstantOptions {
  int width = 512, height = 512;  ///< pixels
  InstantKind kind = InstantKind::tic;
  VirtualLightOptions lights;
  double least_distance = 0.1;  ///< min_d of equation 2
  double unit = 1;              ///< InstantCacheOptions::unit
  InstantCacheOptions cache;    ///< all but its lengths
  int pattern = 3;              ///< InterleavedOptions::pattern
  SurfacePointOptions points;
  bool show_life = false;  ///< ic, tic: an extra picture: frames that records have been good for
};

/// Direct light and lobes as surface_points() has them, indirect light by virtual lights: paths of
/// VirtualLightOptions::bounces reflections before the last, diffuse ones alone.
class InstantMethod : public AnimationMethod {
 public:
  /// `scene` must outlive it.
  InstantMethod(const AnimatedScene& scene, const InstantOptions& options);

  std::vector<std::string> figures() const override;
  FramePicture frame(int number, const Progress& progress) override;
  /// A frame of the scene as it stands, whatever was drawn before: nothing need be known of it.
  FramePicture draw(AnimatedFrame frame, const Progress& progress);
  /// Of the pictures to come. Records stay.
  void set_size(int width, int height) { options_.width = width, options_.height = height; }
  void show_life(bool on) { options_.show_life = on; }

 private:
  Image life() const;
  const AnimatedScene& scene_;
  InstantOptions options_;
  MovingVisibility visibility_;
  InstantCache cache_;
  double extent_ = 0;  // of visibility_, that the cache's lengths are set for
  std::vector<SurfaceRow> rows_;
  std::vector<std::vector<RgbD>> irradiance_;
};

}  // namespace haarlight
