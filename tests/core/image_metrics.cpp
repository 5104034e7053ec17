// How far apart two pictures are, against numbers worked out by hand.

#include "core/image_metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"

namespace haarlight {
namespace {

TEST(ImageMetrics, OneDifferentChannel) {
  Image reference(2, 2), image(2, 2);
  for (Rgb& p : reference.pixels) p = {2, 2, 2};
  image.pixels = reference.pixels;
  image.at(1, 0).b = 5;
  const ImageDifference d = compare_images(image, reference);
  // Squares: 9 over 12 values; reference 12 * 4 over 12 values.
  EXPECT_DOUBLE_EQ(d.rmse, std::sqrt(9.0 / 12));
  EXPECT_DOUBLE_EQ(d.relative_rmse, std::sqrt(9.0 / 48));
  EXPECT_DOUBLE_EQ(d.psnr, 10 * std::log10(4 / (9.0 / 12)));
  EXPECT_EQ(d.max_abs, 3);
  EXPECT_EQ(d.max_x, 1);
  EXPECT_EQ(d.max_y, 0);
}

TEST(ImageMetrics, FirstOfEqualDifferencesInRasterOrder) {
  Image reference(3, 3), image(3, 3);
  image.at(1, 2).r = -1;
  image.at(2, 1).g = 1;
  const ImageDifference d = compare_images(image, reference);
  EXPECT_EQ(d.max_x, 2);
  EXPECT_EQ(d.max_y, 1);
  EXPECT_TRUE(std::isinf(d.relative_rmse)) << "anything is infinitely more than black";
}

TEST(ImageMetrics, EqualPictures) {
  Image image(5, 1);
  ImageDifference d = compare_images(image, image);
  EXPECT_EQ(d.rmse, 0);
  EXPECT_EQ(d.relative_rmse, 0);
  EXPECT_EQ(d.psnr, std::numeric_limits<double>::infinity());
  EXPECT_EQ(d.max_abs, 0);
}

TEST(ImageMetrics, RelativeErrorDoesNotDependOnScale) {
  Image reference(8, 8), image(8, 8);
  for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
    const auto v = static_cast<float>(i + 1);
    reference.pixels[i] = {v, 2 * v, 3 * v};
    image.pixels[i] = {v, 2 * v + 1, 3 * v};
  }
  const double unscaled = compare_images(image, reference).relative_rmse;
  for (const int exponent : {-40, 40}) {
    Image a = image, b = reference;
    for (Rgb& p : a.pixels) p *= std::ldexp(1.0f, exponent);
    for (Rgb& p : b.pixels) p *= std::ldexp(1.0f, exponent);
    EXPECT_EQ(compare_images(a, b).relative_rmse, unscaled) << "powers of two change no mantissa";
  }
}

TEST(ImageMetrics, RefusesWhatHasNoDifference) {
  Image a(2, 2), bad(2, 2);
  bad.at(1, 1).g = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(compare_images(a, Image(2, 3)), Error);
  EXPECT_THROW(compare_images(Image(), Image()), Error);
  EXPECT_THROW(compare_images(bad, a), Error);
  try {
    compare_images(a, bad);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::invalid_argument);
    EXPECT_NE(std::string(error.what()).find("reference is not finite at pixel (1, 1)"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace haarlight
