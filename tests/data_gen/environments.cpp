// The project's own lights: what they promise about their brightness, and that they never change.

#include "data_gen/environments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"

namespace haarlight::data_gen {
namespace {

struct Statistics {
  double mean = 0, largest = 0;
  double brightest_thousandth = 0;  // share of all light that 0.1 % of the sphere sends
};

// Solid-angle weighted; `image` is lat-long.
Statistics measure(const Image& image) {
  struct Pixel {
    double light, weight;
  };
  std::vector<Pixel> pixels;
  double light_sum = 0, weight_sum = 0;
  Statistics statistics;
  for (int y = 0; y < image.height; ++y) {
    const double weight = std::sin(kPi * (y + 0.5) / image.height);
    for (int x = 0; x < image.width; ++x) {
      const double light = luminance(RgbD(image.at(x, y)));
      pixels.push_back({light, weight});
      light_sum += light * weight;
      weight_sum += weight;
      statistics.largest = std::max(statistics.largest, light);
    }
  }
  std::sort(pixels.begin(), pixels.end(),
            [](const Pixel& a, const Pixel& b) { return a.light > b.light; });
  double covered = 0, bright = 0;
  for (const Pixel& pixel : pixels) {
    if (covered >= 0.001 * weight_sum) break;
    covered += pixel.weight;
    bright += pixel.light * pixel.weight;
  }
  statistics.mean = light_sum / weight_sum;
  statistics.brightest_thousandth = bright / light_sum;
  return statistics;
}

TEST(Environments, GalleryHasTheRangeOfARealInterior) {
  const Statistics s =
      measure(draw_environment(make_environment("gallery"), Projection::latlong, 1024));
  EXPECT_GT(s.largest / s.mean, 1e3);
  EXPECT_LT(s.largest / s.mean, 1e4);
  EXPECT_GT(s.brightest_thousandth, 0.15);
  EXPECT_LT(s.brightest_thousandth, 0.40);
}

TEST(Environments, SunCarriesAboutHalfOfTheClearSkysLight) {
  const EnvironmentModel sky = make_environment("sky");
  ASSERT_EQ(sky.discs.size(), 1u);
  const double sun = luminance(sky.discs[0].radiance) * sky.discs[0].solid_angle();
  const Statistics s = measure(draw_environment(sky, Projection::latlong, 1024));
  EXPECT_GT(sun / (4 * kPi * s.mean), 0.35);
  EXPECT_LT(sun / (4 * kPi * s.mean), 0.60);
}

TEST(Environments, EveryOneIsFiniteAndNotNegativeInEveryLayout) {
  for (const EnvironmentEntry& entry : environments()) {
    for (const auto& [projection, size] : {std::pair{Projection::latlong, 128},
                                           {Projection::angular, 96},
                                           {Projection::vertical_cross, 96}}) {
      const Image image = draw_environment(entry.make(1), projection, size);
      double sum = 0;
      for (const Rgb& pixel : image.pixels) {
        ASSERT_TRUE(is_finite(pixel)) << entry.name;
        ASSERT_GE(std::min({pixel.r, pixel.g, pixel.b}), 0.0f) << entry.name;
        sum += luminance(pixel);
      }
      EXPECT_GT(sum, 0) << entry.name;
    }
  }
}

TEST(Environments, SameSeedSamePictureOnAnyNumberOfThreads) {
  const int threads = thread_count();
  for (const EnvironmentEntry& entry : environments()) {
    set_thread_count(1);
    const Image one = draw_environment(entry.make(7), Projection::latlong, 128);
    set_thread_count(7);
    const Image seven = draw_environment(entry.make(7), Projection::latlong, 128);
    EXPECT_EQ(one.pixels, seven.pixels) << entry.name;
  }
  set_thread_count(threads);
}

TEST(Environments, AnotherSeedIsAnotherLight) {
  for (const char* name : {"gallery", "sky", "clouds"}) {
    const Image a = draw_environment(make_environment(name, 1), Projection::latlong, 64);
    const Image b = draw_environment(make_environment(name, 2), Projection::latlong, 64);
    EXPECT_NE(a.pixels, b.pixels) << name;
  }
}

TEST(Environments, PixelsAreMeansOfTheModel) {
  // Light that is linear in the place on the lat-long map has its value at a pixel's middle as the
  // pixel's mean. Azimuth jumps at the border, which no pixel crosses.
  EnvironmentModel model;
  model.smooth = [](const Vec3& d) {
    return RgbD{std::acos(d.y) / kPi, 0.5 + std::atan2(d.x, -d.z) / (2 * kPi), 1};
  };
  const Image image = draw_environment(model, Projection::latlong, 36);
  for (int y = 0; y < 18; ++y) {
    for (int x = 0; x < 36; ++x) {
      EXPECT_NEAR(image.at(x, y).r, (y + 0.5) / 18, 1e-6) << x << " " << y;
      EXPECT_NEAR(image.at(x, y).g, (x + 0.5) / 36, 1e-6) << x << " " << y;
      EXPECT_EQ(image.at(x, y).b, 1.0f) << x << " " << y;
    }
  }
}

TEST(Environments, WrongNamesAndSizesAreRefused) {
  const auto kind_of = [](auto&& call) {
    try {
      call();
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(kind_of([] { make_environment("moon"); }).find("gallery, sky, clouds, labels"),
            std::string::npos);
  const EnvironmentModel model = make_environment("labels");
  EXPECT_THROW(draw_environment(model, Projection::latlong, 7), Error);
  EXPECT_THROW(draw_environment(model, Projection::latlong, 101), Error);
  EXPECT_THROW(draw_environment(model, Projection::vertical_cross, 100), Error);
  EXPECT_THROW(draw_environment(model, Projection::angular, 16385), Error);
}

}  // namespace
}  // namespace haarlight::data_gen
