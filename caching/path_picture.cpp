// A frame by path tracing.

#include "caching/path_picture.h"

#include <algorithm>
#include <chrono>

#include "core/error.h"
#include "core/hash_bits.h"
#include "core/parallel.h"

namespace haarlight {

Camera frame_camera(const AnimatedFrame& frame, int width, int height) {
  if (!frame.scene.camera) {
    throw Error(ErrorKind::missing,
                frame.scene.name + ": has no camera, expected a perspective one in the scene");
  }
  Camera camera = *frame.scene.camera;
  camera.width = width, camera.height = height;
  return camera;
}

Image path_picture(const FrameTracer& tracer, const PathPictureOptions& options,
                   const Progress& progress) {
  const Camera camera = frame_camera(tracer.frame(), options.width, options.height);
  const Vec3 eye = tracer.visibility().to_local(camera.position);
  const std::uint64_t key =
      mix_bits(options.seed, options.frozen ? 0 : static_cast<std::uint64_t>(tracer.frame().frame));
  Image picture(options.width, options.height);
  // So many rows between two looks at the clock and the keyboard.
  constexpr int kRows = 16;
  for (int top = 0; top < options.height; top += kRows) {
    parallel_for(std::min(kRows, options.height - top), [&](int row) {
      const int y = top + row;
      for (int x = 0; x < options.width; ++x) {
        const std::uint64_t pixel = mix_bits(key, picture.index(x, y));
        RgbD sum;
        for (int s = 0; s < options.samples; ++s) {
          PathRandom random(mix_bits(pixel, static_cast<std::uint64_t>(s)));
          const double u = random.next(), v = random.next();
          const double px = x + (options.centred ? 0.5 : u), py = y + (options.centred ? 0.5 : v);
          sum += tracer.radiance(eye, camera.direction(px, py), random);
        }
        picture.at(x, y) = Rgb(sum * (1.0 / options.samples));
      }
    });
    if (progress &&
        !progress(static_cast<double>(std::min(top + kRows, options.height)) / options.height)) {
      throw Error(ErrorKind::cancelled, "stopped");
    }
  }
  return picture;
}

FramePicture PathMethod::frame(int number, const Progress& progress) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](auto span) { return std::chrono::duration<double, std::milli>(span).count(); };
  const auto begin = Clock::now();
  const AnimatedFrame frame = scene_.at(number);
  const FrameTracer tracer(frame);
  const auto built = Clock::now();
  FramePicture out;
  out.radiance = path_picture(tracer, options_, progress);
  out.figure = {ms(built - begin), ms(Clock::now() - built)};
  return out;
}

}  // namespace haarlight
