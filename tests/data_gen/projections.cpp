// Which pixel is which direction: every layout of environment pinned by the labelled environment,
// from its pixels to what load_environment answers. docs/environments.md says the same in words.

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/image_io.h"
#include "data_gen/environments.h"
#include "data_gen/labels.h"
#include "wavelet/cubemap.h"
#include "wavelet/environment.h"

namespace haarlight::data_gen {
namespace {

constexpr std::array kProjections{Projection::latlong, Projection::angular,
                                  Projection::vertical_cross};

// Colours of the discs, as literals: the table of docs/environments.md.
const Rgb kFront{0.95f, 0.70f, 0.05f}, kBack{0.10f, 0.15f, 0.90f}, kLeft{0.05f, 0.75f, 0.80f},
    kRight{0.90f, 0.05f, 0.05f}, kUp{0.10f, 0.70f, 0.05f}, kDown{0.80f, 0.10f, 0.75f};

struct Landmark {
  std::string_view name;
  Rgb color;
  Vec3 direction;
  double u, v;  // of the whole picture
};

std::vector<Landmark> landmarks(Projection projection) {
  switch (projection) {
    case Projection::latlong:
      return {{"front", kFront, {0, 0, -1}, 0.5, 0.5},
              {"right", kRight, {1, 0, 0}, 0.75, 0.5},
              {"left", kLeft, {-1, 0, 0}, 0.25, 0.5},
              {"back at the left border", kBack, {0, 0, 1}, 0.001, 0.5},
              {"back at the right border", kBack, {0, 0, 1}, 0.999, 0.5},
              {"up", kUp, {0, 1, 0}, 0.3, 0.002},
              {"down", kDown, {0, -1, 0}, 0.3, 0.998}};
    case Projection::angular:
      return {{"front", kFront, {0, 0, -1}, 0.5, 0.5}, {"right", kRight, {1, 0, 0}, 0.75, 0.5},
              {"left", kLeft, {-1, 0, 0}, 0.25, 0.5},  {"up", kUp, {0, 1, 0}, 0.5, 0.25},
              {"down", kDown, {0, -1, 0}, 0.5, 0.75},  {"back", kBack, {0, 0, 1}, 0.985, 0.5},
              {"back", kBack, {0, 0, 1}, 0.5, 0.015}};
    case Projection::vertical_cross:
      return {{"front", kFront, {0, 0, -1}, 0.5, 1.5 / 4},
              {"right", kRight, {1, 0, 0}, 2.5 / 3, 1.5 / 4},
              {"left", kLeft, {-1, 0, 0}, 0.5 / 3, 1.5 / 4},
              {"up", kUp, {0, 1, 0}, 0.5, 0.5 / 4},
              {"down", kDown, {0, -1, 0}, 0.5, 2.5 / 4},
              {"back", kBack, {0, 0, 1}, 0.5, 3.5 / 4}};
  }
  return {};
}

int test_size(Projection projection) { return projection == Projection::latlong ? 1024 : 768; }

double difference(const Rgb& a, const Rgb& b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

// The labelled environment of a layout as a file, read the way the program reads it.
class LabelledFile {
 public:
  explicit LabelledFile(Projection projection)
      : file_(std::filesystem::temp_directory_path() /
              ("haarlight_labels_" + projection_name(projection) + "_" +
               std::to_string(::getpid()) + ".exr")) {
    save_image(file_,
               draw_environment(make_environment("labels"), projection, test_size(projection)));
  }
  ~LabelledFile() { std::filesystem::remove(file_); }
  LabelledFile(const LabelledFile&) = delete;
  LabelledFile& operator=(const LabelledFile&) = delete;

  const std::filesystem::path& path() const { return file_; }

 private:
  std::filesystem::path file_;
};

// Points spread evenly over the sphere (Fibonacci lattice): direction i of n.
Vec3 sphere_point(int i, int n) {
  const double y = 1 - (2 * i + 1.0) / n, ring = std::sqrt(1 - y * y);
  const double azimuth = 2.39996322972865332 * i;
  return {ring * std::cos(azimuth), y, ring * std::sin(azimuth)};
}

TEST(Projections, ShapeOfTheFileTellsTheLayout) {
  for (const Projection projection : kProjections) {
    const LabelledFile file(projection);
    EXPECT_EQ(load_environment(file.path()).projection(), projection)
        << projection_name(projection);
  }
}

TEST(Projections, LandmarkPixelsHaveTheColourOfTheirAxis) {
  for (const Projection projection : kProjections) {
    const LabelledFile file(projection);
    const Image image = load_image(file.path());
    for (const Landmark& mark : landmarks(projection)) {
      const Rgb pixel =
          image.at(static_cast<int>(mark.u * image.width), static_cast<int>(mark.v * image.height));
      // Inside a disc all sub-pixels have one colour: nothing but float rounding is left.
      EXPECT_LT(difference(pixel, mark.color), 1e-6)
          << projection_name(projection) << ": " << mark.name;
    }
  }
}

TEST(Projections, LoadedEnvironmentAnswersAlongTheAxes) {
  for (const Projection projection : kProjections) {
    const LabelledFile file(projection);
    const Environment environment = load_environment(file.path());
    for (const Landmark& mark : landmarks(projection)) {
      EXPECT_LT(difference(environment.radiance(mark.direction), mark.color), 1e-5)
          << projection_name(projection) << ": " << mark.name;
    }
  }
}

// Is the labelled environment of one colour all around `direction`, within 0.02 rad? That is more
// than the reach of bilinear lookup in the coarsest test picture, 1.5 pixels of pi / 384
// diagonally.
bool is_flat(const Vec3& direction) {
  const Vec3 side =
      normalize(cross(direction, std::abs(direction.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  const Vec3 other = cross(direction, side);
  const RgbD here = label_radiance(direction);
  for (const double reach : {0.01, 0.02}) {
    for (int i = 0; i < 12; ++i) {
      const double around = 2 * kPi * i / 12;
      const Vec3 near = direction + (side * std::cos(around) + other * std::sin(around)) * reach;
      if (!(label_radiance(normalize(near)) == here)) return false;
    }
  }
  return true;
}

TEST(Projections, LoadedEnvironmentAnswersInEveryDirectionAndIsNotMirrored) {
  std::vector<Vec3> directions;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    if (is_flat(sphere_point(i, kCount))) directions.push_back(sphere_point(i, kCount));
  }
  ASSERT_GT(directions.size(), kCount / 4);
  for (const Projection projection : kProjections) {
    const LabelledFile file(projection);
    const Environment environment = load_environment(file.path());
    // Share of directions in which the environment shows what `turned` says is there.
    const auto agreement = [&](auto&& turned) {
      std::size_t same = 0;
      for (const Vec3& d : directions) {
        if (difference(environment.radiance(d), Rgb(label_radiance(turned(d)))) < 1e-5) ++same;
      }
      return static_cast<double>(same) / static_cast<double>(directions.size());
    };
    const std::string name = projection_name(projection);
    EXPECT_EQ(agreement([](const Vec3& d) { return d; }), 1.0) << name;
    // Mirrored along an axis, at least the two regions of that axis change colour, a third of the
    // sphere; turned by a quarter about +Y, the four side regions do.
    EXPECT_LT(agreement([](const Vec3& d) { return Vec3{-d.x, d.y, d.z}; }), 0.75) << name;
    EXPECT_LT(agreement([](const Vec3& d) { return Vec3{d.x, -d.y, d.z}; }), 0.75) << name;
    EXPECT_LT(agreement([](const Vec3& d) { return Vec3{d.x, d.y, -d.z}; }), 0.75) << name;
    EXPECT_LT(agreement([](const Vec3& d) { return Vec3{d.z, d.y, -d.x}; }), 0.5) << name;
  }
}

// The first letter of each word, drawn here once more by hand.
constexpr std::array<std::string_view, 7> kLetterF{"#####", "#....", "#....", "####.",
                                                   "#....", "#....", "#...."};
constexpr std::array<std::string_view, 7> kLetterL{"#....", "#....", "#....", "#....",
                                                   "#....", "#....", "#####"};
constexpr std::array<std::string_view, 7> kLetterR{"####.", "#...#", "#...#", "####.",
                                                   "#.#..", "#..#.", "#...#"};
constexpr std::array<std::string_view, 7> kLetterU{"#...#", "#...#", "#...#", "#...#",
                                                   "#...#", "#...#", ".###."};
constexpr std::array<std::string_view, 7> kLetterD{"####.", "#...#", "#...#", "#...#",
                                                   "#...#", "#...#", "####."};

TEST(Projections, WordsInTheCrossReadFromLeftToRight) {
  const Image image = draw_environment(make_environment("labels"), Projection::vertical_cross, 768);
  struct Word {
    std::string_view name;
    int column, row;  // of the cross
    std::size_t letters;
    const std::array<std::string_view, 7>& first;
  };
  const std::array words{Word{"FRONT", 1, 1, 5, kLetterF}, Word{"LEFT", 0, 1, 4, kLetterL},
                         Word{"RIGHT", 2, 1, 5, kLetterR}, Word{"UP", 1, 0, 2, kLetterU},
                         Word{"DOWN", 1, 2, 4, kLetterD}};
  for (const Word& word : words) {
    for (std::size_t row = 0; row < 7; ++row) {
      for (std::size_t column = 0; column < 5; ++column) {
        // Middle of the cell on the face, x to the right and y up in [-1, 1].
        const double width = (6.0 * static_cast<double>(word.letters) - 1) * kLabelCell;
        const double x = -width / 2 + (static_cast<double>(column) + 0.5) * kLabelCell;
        const double y = kWordBottom + (6.5 - static_cast<double>(row)) * kLabelCell;
        const int px = static_cast<int>((word.column + 0.5 * (1 + x)) * 256);
        const int py = static_cast<int>((word.row + 0.5 * (1 - y)) * 256);
        const bool ink = image.at(px, py).g < 0.1f;
        EXPECT_EQ(ink, word.first[row][column] == '#')
            << word.name << " row " << row << " column " << column;
      }
    }
  }
}

double energy(const Cubemap& cubemap) {
  const std::vector<double> solid_angle = cube_solid_angles(cubemap.n);
  double sum = 0;
  for (std::size_t i = 0; i < cubemap.texels.size(); ++i) {
    sum += luminance(RgbD(cubemap.texels[i])) * solid_angle[i % solid_angle.size()];
  }
  return sum;
}

TEST(Projections, EnergyOfTheLabelsIsTheSameInEveryLayout) {
  // The integral over the sphere from the definition, without any picture. The lattice's error is
  // of the order (edge length) x n^(-3/4), here below 60 * 300000^(-3/4) / 4 pi = 4e-4.
  constexpr int kCount = 300000;
  double exact = 0;
  for (int i = 0; i < kCount; ++i) exact += luminance(label_radiance(sphere_point(i, kCount)));
  exact *= 4 * kPi / kCount;
  for (const Projection projection : kProjections) {
    const LabelledFile file(projection);
    const double found = energy(environment_to_cubemap(load_environment(file.path()), 32));
    EXPECT_NEAR(found / exact, 1.0, 0.005) << projection_name(projection);
  }
}

TEST(Projections, ASmallLightKeepsItsEnergyInEveryLayout) {
  // A disc of two degrees on black: radiance x 2 pi (1 - cos) whatever the layout. The sampler may
  // be 2 % off, and 16 x 16 places a pixel miss a disc this size by up to about 1 %.
  const std::array directions{normalize(Vec3{0.2, 0.9, -0.4}), normalize(Vec3{-0.7, -0.2, -0.5}),
                              normalize(Vec3{0.9, 0.15, 0.3}), normalize(Vec3{-0.3, -0.8, 0.3})};
  for (const Projection projection : kProjections) {
    for (const Vec3& direction : directions) {
      EnvironmentModel model;
      model.smooth = [](const Vec3&) { return RgbD{}; };
      model.discs.push_back({direction, kPi / 180, {1000, 1000, 1000}});
      const Environment environment(draw_environment(model, projection, test_size(projection) / 2));
      const double exact = 1000 * 2 * kPi * (1 - std::cos(kPi / 180));
      EXPECT_NEAR(energy(environment_to_cubemap(environment, 64)) / exact, 1.0, 0.03)
          << projection_name(projection) << " " << direction.x << " " << direction.y << " "
          << direction.z;
    }
  }
}

}  // namespace
}  // namespace haarlight::data_gen
