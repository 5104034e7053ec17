// A frame by path tracing: the truth that all caches are measured against.

#pragma once

#include "caching/animation_method.h"
#include "caching/frame_tracer.h"
#include "core/image.h"
#include "core/progress.h"

namespace haarlight {

struct PathPictureOptions {
  int width = 512, height = 512;  ///< pixels
  int samples = 64;               ///< paths a pixel, >= 1
  std::uint64_t seed = 1;         ///< another seed, other noise
  bool frozen = false;            ///< the same random numbers in every frame
  bool centred = false;           ///< all paths through the middle of the pixel: no box filter
};

/// The frame as its camera sees it, radiance, box filter unless `centred`. Unbiased but for paths
/// of more than 256 bounces. Random numbers depend on frame (unless
/// `frozen`), pixel and sample alone: the same bits
/// on any number of threads. Throws Error{missing} if the frame has no camera, Error{cancelled}
/// when told to stop.
Image path_picture(const FrameTracer& tracer, const PathPictureOptions& options,
                   const Progress& progress = {});

/// The camera of a frame for a picture of this size. Throws Error{missing} if it has none.
Camera frame_camera(const AnimatedFrame& frame, int width, int height);

/// The method `path`. `scene` must outlive it.
class PathMethod : public AnimationMethod {
 public:
  PathMethod(const AnimatedScene& scene, const PathPictureOptions& options)
      : scene_(scene), options_(options) {}
  std::vector<std::string> figures() const override { return {"build_ms", "render_ms"}; }
  FramePicture frame(int number, const Progress& progress) override;

 private:
  const AnimatedScene& scene_;
  PathPictureOptions options_;
};

}  // namespace haarlight
