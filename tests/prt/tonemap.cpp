// From radiance to a display: curves at known points, and nothing but [0, 1] comes out.

#include "prt/tonemap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/error.h"

namespace haarlight {
namespace {

constexpr TonemapCurve kCurves[] = {TonemapCurve::linear, TonemapCurve::reinhard,
                                    TonemapCurve::filmic};

Image pixel(const Rgb& value) {
  Image image(1, 1);
  image.pixels[0] = value;
  return image;
}
Rgb shown(const Rgb& value, TonemapCurve curve, double ev = 0) {
  return tonemap(pixel(value), {.curve = curve, .exposure_ev = ev}).pixels[0];
}

TEST(Tonemap, CurvesAtKnownPoints) {
  EXPECT_EQ(shown({0.25f, 0.5f, 2}, TonemapCurve::linear), Rgb(0.25f, 0.5f, 1));
  // Grey 1 has luminance 1 and becomes 1 / 2; grey 3 becomes 3 / 4.
  EXPECT_FLOAT_EQ(shown({1, 1, 1}, TonemapCurve::reinhard).g, 0.5f);
  EXPECT_FLOAT_EQ(shown({3, 3, 3}, TonemapCurve::reinhard).b, 0.75f);
  // A pure colour keeps its ratios: green 1 has luminance 0.7152.
  const Rgb green = shown({0, 1, 0}, TonemapCurve::reinhard);
  EXPECT_EQ(green.r, 0);
  EXPECT_FLOAT_EQ(green.g, 1 / 1.7152f);
  // Narkowicz's fit at 1: 2.54 / 3.16; at 0.18: 0.086724 / 0.324932.
  EXPECT_FLOAT_EQ(shown({1, 0, 0}, TonemapCurve::filmic).r, static_cast<float>(2.54 / 3.16));
  EXPECT_FLOAT_EQ(shown({0, 0.18f, 0}, TonemapCurve::filmic).g,
                  static_cast<float>(0.086724 / 0.324932));
}

TEST(Tonemap, CurvesRiseFromBlackToWhite) {
  for (const TonemapCurve curve : kCurves) {
    EXPECT_EQ(shown({0, 0, 0}, curve), Rgb());
    float last = 0;
    for (double x = 1e-4; x < 1e4; x *= 1.1) {
      const auto value = static_cast<float>(x);
      const float y = shown({value, value, value}, curve).r;
      EXPECT_GE(y, last) << x;
      last = y;
    }
    EXPECT_GT(last, 0.999f);
  }
}

TEST(Tonemap, ExposureIsInStops) {
  for (const TonemapCurve curve : kCurves) {
    EXPECT_EQ(shown({0.1f, 0.2f, 0.3f}, curve, 2), shown({0.4f, 0.8f, 1.2f}, curve));
    EXPECT_EQ(shown({0.4f, 0.8f, 1.2f}, curve, -2), shown({0.1f, 0.2f, 0.3f}, curve));
  }
  EXPECT_THROW(shown({1, 1, 1}, TonemapCurve::linear, std::numeric_limits<double>::quiet_NaN()),
               Error);
  EXPECT_THROW(shown({1, 1, 1}, TonemapCurve::linear, std::numeric_limits<double>::infinity()),
               Error);
}

TEST(Tonemap, AnythingBecomesSomethingShowable) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<float> values = {0,
                                     -1,
                                     -kInfinity,
                                     kInfinity,
                                     std::numeric_limits<float>::quiet_NaN(),
                                     std::numeric_limits<float>::max(),
                                     std::numeric_limits<float>::denorm_min()};
  for (const TonemapCurve curve : kCurves) {
    for (const float r : values) {
      for (const float b : values) {
        for (const double ev : {-1000.0, 0.0, 1000.0}) {
          const Rgb y = shown({r, 0.5f, b}, curve, ev);
          for (const float channel : {y.r, y.g, y.b}) {
            EXPECT_TRUE(channel >= 0 && channel <= 1) << r << ", " << b << " at " << ev;
          }
        }
      }
    }
    EXPECT_EQ(shown({-5, -0.0f, -1}, curve), Rgb());
  }
  // One bright channel must not be lost for its size, nor a broken one darken the others.
  EXPECT_EQ(shown({kInfinity, 0.5f, -1}, TonemapCurve::linear), Rgb(1, 0.5f, 0));
  EXPECT_EQ(shown({kInfinity, 0, 0}, TonemapCurve::filmic).r, 1);
}

TEST(Tonemap, KeepsTheShape) {
  Image image(3, 2);
  for (std::size_t i = 0; i < 6; ++i) image.pixels[i] = {static_cast<float>(i) / 10, 0, 0};
  const Image out = tonemap(image, {.curve = TonemapCurve::linear, .exposure_ev = 0});
  EXPECT_EQ(out.width, 3);
  EXPECT_EQ(out.height, 2);
  EXPECT_TRUE(out.pixels == image.pixels);
}

TEST(AutoExposure, BringsTheMeanLogLuminanceToMidGrey) {
  Image image(4, 1);
  image.pixels = {{1, 1, 1}, {4, 4, 4}, {0, 0, 0}, {-1, 0, 0}};
  // Two pixels count; their geometric mean is 2.
  EXPECT_NEAR(auto_exposure_ev(image), std::log2(0.18 / 2), 1e-6);
  for (Rgb& p : image.pixels) p *= 1024;
  EXPECT_NEAR(auto_exposure_ev(image), std::log2(0.18 / 2048), 1e-6);
  image.pixels[0].r = std::numeric_limits<float>::infinity();
  EXPECT_NEAR(auto_exposure_ev(image), std::log2(0.18 / 4096), 1e-6)
      << "what is not finite is left out";
  EXPECT_EQ(auto_exposure_ev(Image(5, 5)), 0);
  EXPECT_EQ(auto_exposure_ev(Image()), 0);
}

// A stop is the same step of colour at every exposure; what has no light is black.
TEST(FalseColour, CountsStopsFromMidGrey) {
  Image image(4, 1);
  image.at(0, 0) = {0.18f, 0.18f, 0.18f};
  image.at(1, 0) = {0.72f, 0.72f, 0.72f};
  image.at(2, 0) = {0, -1, 0};
  image.at(3, 0) = {1e30f, 1e30f, 1e30f};
  const Image drawn = false_colour(image, -1);
  const auto expect_near = [](const Rgb& a, const Rgb& b) {
    // 0.18 and its logarithm are rounded to float: 2^-24 relative, steepest slope below 2 a stop.
    EXPECT_LE(l1_norm(a - b), 1e-5f);
  };
  expect_near(drawn.at(0, 0), false_colour_of(-1));
  expect_near(drawn.at(1, 0), false_colour_of(1));
  EXPECT_EQ(drawn.at(2, 0), Rgb{});
  EXPECT_EQ(drawn.at(3, 0), false_colour_of(kFalseColourStops));
  EXPECT_EQ(false_colour_of(100), false_colour_of(kFalseColourStops));
  // Blue below, green in the middle, red above, as Turbo is.
  const Rgb low = false_colour_of(-3.5), mid = false_colour_of(0), high = false_colour_of(4);
  EXPECT_GT(low.b, low.r);
  EXPECT_GT(mid.g, mid.b);
  EXPECT_GT(high.r, high.g);
  EXPECT_THROW(false_colour(image, std::numeric_limits<double>::infinity()), Error);
}

}  // namespace
}  // namespace haarlight
