// Relights a precomputed scene under a turning environment: relight_minimal FILE.hlt ENV OUT.exr

#include <cstdio>
#include <exception>

#include "core/image_io.h"
#include "prt/image_relighter.h"
#include "prt/lighting_tracker.h"
#include "prt/motion.h"

int main(int argc, char** argv) try {
  using namespace haarlight;
  if (argc != 4) {
    std::fprintf(stderr, "usage: relight_minimal FILE.hlt ENVIRONMENT OUT.exr\n");
    return 2;
  }
  const Transport transport = Transport::open(argv[1]);
  Motion motion({.kind = MotionKind::rotate, .degrees = 90, .stop = 19}, transport.layout(),
                load_environment(argv[2]));
  LightingTracker tracker(transport.layout(), {.method = LightingMethod::pbi, .wavelets = 30});
  ImageRelighter relighter(transport);

  // The first frame is exact; from then on at most 30 wavelets change in a frame.
  relighter.apply(tracker.start_exact(motion.coefficients(0)));
  for (int frame = 1; frame < 30; ++frame) {
    relighter.apply(tracker.advance(motion.coefficients(frame)));
  }
  save_image(argv[3], relighter.picture());
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "relight_minimal: %s\n", error.what());
  return 1;
}
