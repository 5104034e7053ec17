// Rows 9 and 50: denormals cost no time, and arithmetic that has been tampered with is noticed.

#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "core/denormals.h"
#include "core/error.h"
#include "core/float_check.h"
#include "prt/image_relighter.h"
#include "prt/motion.h"
#include "tests/hard/hard_case.h"
#include "tests/hard/oracle.h"

namespace haarlight {
namespace {

using namespace hard;

// Of the processor, all threads together: whatever else runs, it does not count.
double processor_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Frames of a turning sky of `scale` times some texture, from its cells to pixels.
class TurningSky {
 public:
  TurningSky(const Transport& transport, double scale, float dark)
      : relighter_(transport), tracker_(transport.layout(), options_of(LightingMethod::pbi, 30)) {
    Image sky(64, 32);
    for (std::size_t i = 0; i < sky.pixels.size(); ++i) {
      const auto value = static_cast<float>(scale * static_cast<double>(i * 2654435761u % 1000));
      sky.pixels[i] = i % 3 ? Rgb{value, dark, value} : Rgb{dark, dark, dark};
    }
    motion_.emplace(MotionOptions{.kind = MotionKind::rotate, .degrees = 90, .stop = 1000000},
                    transport.layout(), Environment(sky));
  }
  double seconds(int frames) {
    const double begin = processor_seconds();
    for (int i = 0; i < frames; ++i) {
      relighter_.apply(tracker_.advance(motion_->coefficients(frame_ += 1000)));
    }
    return processor_seconds() - begin;
  }
  // Of the last frame's pixels' numbers, how many have the exponent of denormals.
  std::int64_t denormals() const {
    std::int64_t count = 0;
    for (const Rgb& pixel : relighter_.picture().pixels) {
      for (const float x : {pixel.r, pixel.g, pixel.b}) count += std::fpclassify(x) == FP_SUBNORMAL;
    }
    return count;
  }

 private:
  ImageRelighter relighter_;
  LightingTracker tracker_;
  std::optional<Motion> motion_;
  int frame_ = 0;
};

TEST(HardCases, Row09_Denormals) {
  property("a frame of denormal light, or of traces beside light, takes at most 1.2 times as long");
  fixtures::SmallTransport small = fixtures::small_transport(16, 128, 128, 31, 0.5, false);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  for (TileRows& tile : small.tiles) tile.color.assign(tile.color.size(), Rgb{1e-9f, 1e-9f, 1e-9f});
  const Transport black = build_transport(small.info, small.tiles, small.thresholds);
  TurningSky normal(transport, 1, 0.5f);
  struct Case {
    const char* name;
    double scale;
    float dark;
    const Transport& transport;
  };
  // Whole skies below 1.2e-38; some whose products with transport are; traces beside real light.
  for (const Case& c :
       {Case{"denormal sky", 1e-43, 1e-44f, transport}, Case{"1e-33 sky", 1e-36, 1e-36f, transport},
        Case{"denormals beside light", 1, 3e-39f, transport},
        Case{"1e-28 sky on black velvet", 1e-31, 0.0f, black}}) {
    TurningSky sky(c.transport, c.scale, c.dark);
    // The least of many, in turns: what disturbs a run makes it longer, never shorter.
    double plain = HUGE_VAL, traces = HUGE_VAL;
    std::int64_t denormals = 0;
    for (int round = 0; round < 12 && (round < 3 || traces > 1.1 * plain); ++round) {
      for (int run = 0; run < 5; ++run) {
        plain = std::min(plain, normal.seconds(4));
        traces = std::min(traces, sky.seconds(4));
        denormals += sky.denormals();
      }
    }
    const double ratio = traces / plain;
    at_most(std::string(c.name) + ": time of a normal one", ratio, 1.2);
#if defined(__SSE__)
    at_most(std::string(c.name) + ": denormals in pixels", static_cast<double>(denormals), 0);
#endif
  }
}

TEST(HardCases, Row50_FastMathIsNoticed) {
  property("programs refuse to start where denormals, NaN or rounding are not those of IEEE 754");
  double unnoticed = 0, refused = 0;
  try {
    check_float_arithmetic();
  } catch (const Error& error) {
    ++refused;
    ADD_FAILURE() << error.what();
  }
#if defined(__SSE__)
  // What a library built with fast-math does when it is loaded, and other roundings.
  const unsigned before = _mm_getcsr();
  for (const unsigned bits : {0x8000u, 0x0040u, 0x8040u, 0x2000u, 0x4000u, 0x6000u}) {
    _mm_setcsr(before | bits);
    bool noticed = false;
    try {
      check_float_arithmetic();
    } catch (const Error&) {
      noticed = true;
    }
    _mm_setcsr(before);
    unnoticed += !noticed;
  }
  { const FlushDenormals flush; }
  unnoticed += _mm_getcsr() != before;  // the guard gives back what was set
#endif
  volatile float nan = std::nanf("");
  unnoticed += !std::isnan(nan);
  at_most("settings not noticed", unnoticed, 0);
  at_most("plain arithmetic refused", refused, 0);
}

}  // namespace
}  // namespace haarlight
