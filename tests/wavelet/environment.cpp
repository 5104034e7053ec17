// The gate of environments, and looking one up by direction.

#include "wavelet/environment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "core/error.h"
#include "core/image_io.h"
#include "tests/core/temporary_folder.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Image filled(int width, int height, const Rgb& value) {
  Image image(width, height);
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

std::string message_of(const Image& image, const EnvironmentOptions& options, ErrorKind kind) {
  try {
    Environment(image, options, "a.exr");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "accepted";
  return {};
}

TEST(Environment, NegativeRadianceBecomesBlackAndIsCounted) {
  Image image = filled(64, 32, {1, 2, 3});
  image.at(3, 4) = {-67.7f, 5, 6};
  image.at(9, 9) = {1, -0.5f, -0.25f};
  const Environment environment(image);
  EXPECT_EQ(environment.report().negative_pixels, 2);
  EXPECT_FLOAT_EQ(static_cast<float>(environment.report().smallest), -67.7f);
  EXPECT_EQ(environment.report().not_finite_pixels, 0);
  EXPECT_EQ(environment.picture().at(3, 4), Rgb(0, 5, 6));
  EXPECT_EQ(environment.picture().at(9, 9), Rgb(1, 0, 0));
  EXPECT_EQ(environment.picture().at(0, 0), Rgb(1, 2, 3));
}

TEST(Environment, FewBrokenPixelsAreRepairedAndManyRefused) {
  Image image = filled(64, 32, {1, 1, 1});  // 2048 pixels: 2 may be broken
  image.at(0, 0).g = kNan;
  image.at(63, 31) = {kInfinity, -kInfinity, 0};
  const Environment environment(image);
  EXPECT_EQ(environment.report().not_finite_pixels, 2);
  EXPECT_EQ(environment.report().negative_pixels, 0);
  EXPECT_EQ(environment.picture().at(0, 0), Rgb());
  EXPECT_EQ(environment.picture().at(63, 31), Rgb());

  image.at(1, 1).b = kNan;
  EXPECT_EQ(message_of(image, {}, ErrorKind::format),
            "a.exr: 3 of 2048 pixels are not finite, expected at most 2");
  EXPECT_EQ(message_of(filled(512, 256, {kNan, kNan, kNan}), {}, ErrorKind::format),
            "a.exr: 131072 of 131072 pixels are not finite, expected at most 131");
}

TEST(Environment, AbsurdValuesAreRefusedAfterScaling) {
  Image image = filled(4, 2, {1, 1, 1});
  image.at(2, 1).b = 1.7e18f;
  EXPECT_EQ(Environment(image).picture().at(2, 1).b, 1.7e18f);
  const std::string message = message_of(image, {.projection = {}, .scale = 2}, ErrorKind::format);
  EXPECT_NE(message.find("pixel (2, 1)"), std::string::npos) << message;
  image.at(2, 1).b = 1e38f;
  message_of(image, {}, ErrorKind::format);
}

TEST(Environment, ScaleMultipliesRadiance) {
  const Environment environment(filled(4, 2, {1, 2, 3}), {.projection = {}, .scale = 0.25});
  EXPECT_EQ(environment.picture().at(1, 1), Rgb(0.25f, 0.5f, 0.75f));
  for (const double scale :
       {0.0, -1.0, static_cast<double>(kNan), static_cast<double>(kInfinity)}) {
    message_of(filled(4, 2, {1, 1, 1}), {.projection = {}, .scale = scale},
               ErrorKind::invalid_argument);
  }
}

TEST(Environment, ShapeDecidesTheProjectionUnlessToldOtherwise) {
  EXPECT_EQ(Environment(Image(8, 4)).projection(), Projection::latlong);
  EXPECT_EQ(Environment(Image(8, 8)).projection(), Projection::angular);
  EXPECT_EQ(Environment(Image(6, 8)).projection(), Projection::vertical_cross);
  const EnvironmentOptions latlong{.projection = Projection::latlong, .scale = 1};
  EXPECT_EQ(Environment(Image(8, 8), latlong).projection(), Projection::latlong);
  EXPECT_EQ(message_of(Image(7, 4), {}, ErrorKind::invalid_argument),
            "a.exr: is 7x4, expected 2:1 (latlong), 1:1 (angular) or 3:4 (vertical-cross)");
  const EnvironmentOptions angular{.projection = Projection::angular, .scale = 1};
  message_of(Image(8, 4), angular, ErrorKind::invalid_argument);
  message_of(Image(), {}, ErrorKind::invalid_argument);
}

// A picture whose pixels are a linear function of direction, so that a bilinear lookup is near it
// everywhere: the second derivative of a direction in the picture is at most (2 pi)^2, and linear
// interpolation over a step h errs by h^2 / 8 of that per axis. Half a step more where the layout
// ends and the lookup is clamped.
TEST(Environment, LooksUpWhatIsThere) {
  for (const auto& [width, height] : {std::pair{256, 128}, {256, 256}, {192, 256}}) {
    const Projection projection = *projection_of_shape(width, height);
    Image image(width, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto d = projection_direction(projection, (x + 0.5) / width, (y + 0.5) / height);
        if (!d) continue;
        image.at(x, y) = {static_cast<float>(1 + d->x), static_cast<float>(1 + d->y),
                          static_cast<float>(1 + d->z)};
      }
    }
    const Environment environment(image);
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 20000; ++i) {
      const Vec3 d = normalize({normal(random), normal(random), normal(random)});
      const Rgb got = environment.radiance(d * 10);
      // A clamped lookup is off by half a pixel: 2 pi / 256 / 2, or 2 / 64 / 2 on a cross's face.
      const double tolerance = projection == Projection::vertical_cross ? 0.023 : 0.018;
      ASSERT_NEAR(got.r, 1 + d.x, tolerance) << projection_name(projection);
      ASSERT_NEAR(got.g, 1 + d.y, tolerance) << projection_name(projection);
      ASSERT_NEAR(got.b, 1 + d.z, tolerance) << projection_name(projection);
    }
  }
}

TEST(Environment, AnyLengthIsADirectionAndWhatIsNoneIsRefused) {
  Image picture(8, 4);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    picture.pixels[i] = {static_cast<float>(i), 1, 2};
  }
  const Environment environment(picture);
  const Vec3 direction{0.3, -0.2, 0.9};
  const Rgb there = environment.radiance(direction);
  for (const double size : {1e300, 1e-300, 0x1p-1060, 7.0}) {
    const Rgb found = environment.radiance(size * direction);
    EXPECT_NEAR(found.r, there.r, 1e-3) << size;  // 2^-1060 leaves 14 bits of a number
  }
  const double nan = std::nan("");
  for (const Vec3& none : {Vec3{}, Vec3{nan, 1, 0}, Vec3{1, nan, 0}, Vec3{1, 0, nan},
                           Vec3{HUGE_VAL, 0, 0}, Vec3{0, 1, -HUGE_VAL}}) {
    EXPECT_THROW(environment.radiance(none), Error);
  }
}

TEST(Environment, LookupWrapsAroundTheSeam) {
  Image image(4, 2);
  image.at(0, 1) = {8, 8, 8};  // just right of the left border, which is +Z
  const Environment environment(image);
  // Straight at the seam, level with the row's middle: half of the first and half of the last.
  const Vec3 at_seam = *projection_direction(Projection::latlong, 0, 0.75);
  EXPECT_NEAR(environment.radiance(at_seam).r, 4, 1e-5);
}

TEST(Environment, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  const fs::path file = folder / "nan.exr";
  save_image(file, filled(64, 32, {kNan, 0, 0}));
  try {
    load_environment(file);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::format);
    EXPECT_EQ(error.what(),
              file.string() + ": 2048 of 2048 pixels are not finite, expected at most 2");
  }
  EXPECT_THROW(load_environment(folder / "none.exr"), Error);
}

struct Expected {
  fs::path file;
  double mean, max;
  std::int64_t negative_pixels;
  double smallest;
};

/// Real light probes with numbers counted by others, where they are; always one made here: black
/// but for two pixels; a pixel's share of the sphere is (2 pi / w) (cos top - cos bottom).
std::vector<Expected> probes(const TemporaryFolder& folder) {
  Image image(256, 128);
  image.at(100, 20) = {1000, 1000, 1000};
  image.at(7, 90) = {-0.5f, 0, 0};
  save_image(folder / "pixel.exr", image);
  const double share = 2 * kPi / 256 * (std::cos(kPi * 20 / 128) - std::cos(kPi * 21 / 128));
  const double dark_share = 2 * kPi / 256 * (std::cos(kPi * 90 / 128) - std::cos(kPi * 91 / 128));
  std::vector<Expected> result = {{folder / "pixel.exr",
                                   (1000 * share - 0.5 * 0.2126 * dark_share) / (4 * kPi), 1000, 1,
                                   -0.5}};

  const char* given = std::getenv("HAARLIGHT_TEST_DATA");
  const fs::path data =
      (given ? fs::path(given) : fs::path(HAARLIGHT_SOURCE_DIR) / "../shared/data") /
      "environments";
  const std::vector<Expected> real = {{data / "forest.exr", 0.5415, 953.9, 784, -0.0016},
                                      {data / "interior.exr", 1.050, 32220, 5053, -0.0033},
                                      {data / "lobby.exr", 0.8256, 740.7, 739, -67.7},
                                      {data / "leadenhall_market_1k.hdr", 0.4603, 242.1, 0, 0},
                                      {data / "noon_grass_1k.hdr", 0.5584, 63720, 0, 0}};
  for (const Expected& probe : real) {
    if (fs::exists(probe.file)) result.push_back(probe);
  }
  return result;
}

TEST(Environment, ProbesHaveTheLightTheyShould) {
  const TemporaryFolder folder;
  for (const Expected& probe : probes(folder)) {
    const Environment environment = load_environment(probe.file);
    // The numbers are of the files as they are, negative pixels included.
    const Image picture = load_image(probe.file);
    double sum = 0, max = 0;
    for (int y = 0; y < picture.height; ++y) {
      const double share =
          (std::cos(kPi * y / picture.height) - std::cos(kPi * (y + 1) / picture.height)) /
          (2.0 * picture.width);
      for (int x = 0; x < picture.width; ++x) {
        const double light = luminance(RgbD(picture.at(x, y)));
        sum += share * light;
        max = std::max(max, light);
        const Rgb raw = picture.at(x, y);
        ASSERT_EQ(environment.picture().at(x, y),
                  Rgb(std::max(raw.r, 0.0f), std::max(raw.g, 0.0f), std::max(raw.b, 0.0f)));
      }
    }
    // Four digits are given.
    EXPECT_NEAR(sum / probe.mean, 1, 6e-4) << probe.file;
    EXPECT_NEAR(max / probe.max, 1, 1e-3) << probe.file;
    EXPECT_EQ(environment.report().negative_pixels, probe.negative_pixels) << probe.file;
    EXPECT_NEAR(environment.report().smallest, probe.smallest, 0.01 * -probe.smallest + 5e-5)
        << probe.file;
    EXPECT_EQ(environment.report().not_finite_pixels, 0) << probe.file;
  }
}

}  // namespace
}  // namespace haarlight
