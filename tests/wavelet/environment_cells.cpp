// Cutting environments into cells: the sphere is covered, and every pixel's light stays.

#include "wavelet/environment_cells.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace haarlight {
namespace {

constexpr double kNoLimit = 1e30;  // no block is left unmerged for its blur

struct Case {
  int width, height;
  double cells;
};

// Pixels bigger than a cell, about as big, and smaller, for each projection.
constexpr Case kCases[] = {{2, 1, 3000},    {16, 8, 4000},  {64, 32, 3000},  {256, 128, 3000},
                           {200, 100, 900}, {16, 16, 4000}, {64, 64, 3000},  {200, 200, 3000},
                           {12, 16, 4000},  {48, 64, 2000}, {150, 200, 2000}};

Environment noise(int width, int height) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(0, 1);
  Image image(width, height);
  for (Rgb& p : image.pixels) p = {uniform(random), std::pow(uniform(random), 20.0f) * 50, 0.5f};
  return Environment(image);
}

/// Solid angle of a pixel: closed for lat-long, by fine sampling of the projection otherwise.
double pixel_solid_angle(Projection projection, int x, int y, int width, int height) {
  if (projection == Projection::latlong) {
    return 2 * kPi / width * (std::cos(kPi * y / height) - std::cos(kPi * (y + 1) / height));
  }
  // Area of small parallelograms spanned by the directions of their corners.
  const int k = 16;
  double sum = 0;
  for (int j = 0; j < k; ++j) {
    for (int i = 0; i < k; ++i) {
      const auto at = [&](double dx, double dy) {
        return projection_direction(projection, (x + (i + dx) / k) / width,
                                    (y + (j + dy) / k) / height);
      };
      const auto middle = at(0.5, 0.5), left = at(0.25, 0.5), right = at(0.75, 0.5),
                 above = at(0.5, 0.25), below = at(0.5, 0.75);
      if (!middle || !left || !right || !above || !below) continue;
      sum += 4 * length(cross(*right - *left, *below - *above));
    }
  }
  return sum;
}

TEST(EnvironmentCells, CoverTheSphere) {
  for (const Case& c : kCases) {
    const auto cells = cut_into_cells(noise(c.width, c.height), 4 * kPi / c.cells, kNoLimit);
    double sum = 0;
    Vec3 moment;
    for (const EnvironmentCell& cell : cells) {
      sum += cell.solid_angle;
      moment = moment + cell.center * cell.solid_angle;
      ASSERT_GT(cell.solid_angle, 0);
      ASSERT_NEAR(length(cell.center), 1, 1e-12);
    }
    // Lat-long is exact. The others take a piece's density at its middle: width^2 / 24 of its
    // second derivatives (up to 6 on a face's axis), with width^2 = 4 pi / cells, twice as much if
    // a cell is a pixel and a half.
    const bool exact = c.width == 2 * c.height;
    EXPECT_NEAR(sum / (4 * kPi), 1, exact ? 1e-12 : 4 * kPi / c.cells / 2)
        << c.width << "x" << c.height;
    EXPECT_NEAR(length(moment), 0, 0.02) << "as much on every side";
    EXPECT_GT(static_cast<double>(cells.size()), 0.3 * c.cells) << c.width << "x" << c.height;
    // Cut to the nearest whole number, a cell has 0.56 to 2.25 times its nominal solid angle. Flat
    // layouts are cut as at the middle of the disc or a face: (pi^3 and 24) / 4 pi times as many.
    const double flat = c.width == c.height ? 2.47 : 4 * c.width == 3 * c.height ? 1.91 : 1;
    EXPECT_LT(static_cast<double>(cells.size()), flat * c.cells / 0.56 * 1.1 + 40)
        << c.width << "x" << c.height;
  }
}

TEST(EnvironmentCells, AConstantStaysConstant) {
  for (const Case& c : kCases) {
    Image image(c.width, c.height);
    for (Rgb& p : image.pixels) p = {0.7f, 3, 1e6f};
    for (const EnvironmentCell& cell :
         cut_into_cells(Environment(image), 4 * kPi / c.cells, kNoLimit)) {
      // Floats on the way in the lookup: some roundings of 2^-24.
      ASSERT_NEAR(cell.energy.r / cell.solid_angle / static_cast<double>(0.7f), 1, 3e-7);
      ASSERT_NEAR(cell.energy.g / cell.solid_angle / 3, 1, 3e-7);
      ASSERT_NEAR(cell.energy.b / cell.solid_angle / 1e6, 1, 3e-7);
    }
  }
}

TEST(EnvironmentCells, EveryPixelKeepsItsEnergy) {
  for (const Case& c : kCases) {
    const Projection projection = *projection_of_shape(c.width, c.height);
    // The rows at the top, some below; a column in the middle of each third.
    for (int y = 0; y < c.height; y += y < 2 ? 1 : (c.height + 3) / 4) {
      for (const int x : {c.width / 6, c.width / 2, 5 * c.width / 6}) {
        const auto whole = [&](double dx, double dy) {
          return projection_direction(projection, (x + dx) / c.width, (y + dy) / c.height)
              .has_value();
        };
        // Pixels on the rim of a disc share it with their neighbours outside.
        if (!whole(0, 0) || !whole(1, 0) || !whole(0, 1) || !whole(1, 1)) continue;
        Image image(c.width, c.height);
        image.at(x, y) = {1, 2, 4};
        double red = 0, blue = 0;
        for (const EnvironmentCell& cell :
             cut_into_cells(Environment(image), 4 * kPi / c.cells, kNoLimit)) {
          red += cell.energy.r;
          blue += cell.energy.b;
        }
        const double wanted = pixel_solid_angle(projection, x, y, c.width, c.height);
        // 1 % : the rest of balancing and, off lat-long, the density at the middle of a piece.
        EXPECT_NEAR(red / wanted, 1, 0.01)
            << projection_name(projection) << " " << c.width << " (" << x << ", " << y << ")";
        EXPECT_NEAR(blue / wanted, 4, 0.04);
      }
    }
  }
}

TEST(EnvironmentCells, ABrightPixelStaysWhereItIs) {
  // 8 x 8 pixels a cell; the light is in a corner of its block.
  Image image(256, 128);
  for (Rgb& p : image.pixels) p = {0.01f, 0.01f, 0.01f};
  image.at(96, 64) = {1000, 1000, 1000};
  const Vec3 wanted = *projection_direction(Projection::latlong, 96.5 / 256, 64.5 / 128);
  const double pixel = kPi / 128, solid_angle = 64 * pixel * pixel;
  const auto distance = [&](double blur) {
    Vec3 center;
    double most = 0;
    for (const EnvironmentCell& cell : cut_into_cells(Environment(image), solid_angle, blur)) {
      if (cell.energy.r > most) {
        most = cell.energy.r;
        center = cell.center;
      }
    }
    return length(center - wanted);
  };
  EXPECT_GT(distance(kNoLimit), 2 * pixel) << "merged, it moves to the middle of its block";
  EXPECT_LT(distance(1000 * pixel * pixel * pixel), 0.01 * pixel) << "here it may not";
}

TEST(EnvironmentCells, UnmergedPixelsAreLimited) {
  // Noise everywhere: every block wants to stay apart.
  const double solid_angle = 4 * kPi / 2000;
  const Environment environment = noise(400, 200);
  const std::size_t merged = cut_into_cells(environment, solid_angle, kNoLimit).size();
  const std::size_t apart = cut_into_cells(environment, solid_angle, 0).size();
  EXPECT_GT(apart, merged + 300);
  EXPECT_LE(apart, merged + 500);
}

}  // namespace
}  // namespace haarlight
