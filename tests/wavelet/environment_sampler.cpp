// Turning environments onto cube maps: energy, smoothness, place, texel averages.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "wavelet/environment.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;

/// Uniform over all rotations, from a uniform unit quaternion.
Rotation random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  double q[4] = {normal(random), normal(random), normal(random), normal(random)};
  const double l = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double w = q[0] / l, x = q[1] / l, y = q[2] / l, z = q[3] / l;
  return {{Vec3{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           Vec3{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           Vec3{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

/// A rotation that takes unit `from` to unit `to`, by two frames.
Rotation rotation_between(const Vec3& from, const Vec3& to) {
  const auto frame = [](const Vec3& d) {
    const Vec3 hint = std::abs(d.y) < 0.7 ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
    const Vec3 a = normalize(cross(hint, d));
    return Rotation{{a, cross(d, a), d}};  // rows: takes d to +Z
  };
  return frame(to).transposed() * frame(from);
}

/// One thread while it lives: many short parallel loops wait for each other on a busy machine.
class OneThread {
 public:
  OneThread() { set_thread_count(1); }
  ~OneThread() { set_thread_count(before_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  const int before_ = thread_count();
};

double energy(const Cubemap& map, const std::vector<double>& solid_angle) {
  double sum = 0;
  for (std::size_t k = 0; k < map.texels.size(); ++k) {
    sum += static_cast<double>(map.texels[k].r) * solid_angle[k % solid_angle.size()];
  }
  return sum;
}

struct PixelLight {
  Environment environment;
  Vec3 direction;
  double energy;
};
PixelLight pixel_light(int width, int x, int y, float radiance = 1000) {
  const int height = width / 2;
  Image image(width, height);
  image.at(x, y) = {radiance, radiance, radiance};
  return {Environment(image),
          *projection_direction(Projection::latlong, (x + 0.5) / width, (y + 0.5) / height),
          static_cast<double>(radiance) * 2 * kPi / width *
              (std::cos(kPi * y / height) - std::cos(kPi * (y + 1) / height))};
}

TEST(EnvironmentSampler, AConstantStaysConstant) {
  const OneThread quiet;
  std::mt19937_64 random(1);
  for (const auto& [width, height] : {std::pair{64, 32}, {2, 1}, {48, 48}, {1, 1}, {24, 32}}) {
    Image image(width, height);
    for (Rgb& p : image.pixels) p = {0.7f, 3.1f, 1e6f};
    const Environment environment(image);
    for (const int n : {1, 2, 8, 16, 64}) {
      const EnvironmentSampler sampler(environment, n);
      Cubemap map(n);
      for (int i = 0; i < 5; ++i) {
        sampler.project(i == 0 ? Rotation{} : random_rotation(random), map);
        // Energy and solid angle are sums of m floats each, which drift apart like sqrt(m) 2^-24:
        // m is some dozens, but up to a thousand where an angular map of few pixels has its rim,
        // and for one texel a face.
        const double tolerance = width == height || n == 1 ? 4e-6 : 1e-6;
        for (const Rgb& texel : map.texels) {
          ASSERT_NEAR(texel.r / 0.7f, 1, tolerance) << width << "x" << height << " to " << n;
          ASSERT_NEAR(texel.g / 3.1f, 1, tolerance) << width << "x" << height << " to " << n;
          ASSERT_NEAR(texel.b / 1e6f, 1, tolerance) << width << "x" << height << " to " << n;
        }
      }
    }
  }
}

// Anywhere on the sphere, near the picture's poles, and on and around the cube's edges and corners.
TEST(EnvironmentSampler, ALightOfOnePixelKeepsItsEnergy) {
  const OneThread quiet;
  const int n = 32;
  const std::vector<double> solid_angle = cube_solid_angles(n);
  std::mt19937_64 random(2);
  for (const int width : {32, 256, 700}) {
    for (const int y : {0, 1, width / 8, width / 4}) {
      const PixelLight light = pixel_light(width, width / 3, y);
      const EnvironmentSampler sampler(light.environment, n);
      Cubemap map(n);
      double worst = 0;
      const auto check = [&](const Rotation& rotation) {
        sampler.project(rotation, map);
        worst = std::max(worst, std::abs(energy(map, solid_angle) / light.energy - 1));
      };
      for (int i = 0; i < 40; ++i) check(random_rotation(random));
      for (int code = 0; code < 27; ++code) {
        const Vec3 d{code % 3 - 1.0, code / 3 % 3 - 1.0, code / 9 - 1.0};
        if (d == Vec3{}) continue;
        check(rotation_between(light.direction, normalize(d)));
        check(rotation_between(light.direction,
                               normalize(normalize(d) + Vec3{0.4, 0.2, -0.3} * (1.0 / n))));
      }
      EXPECT_LE(worst, 0.02) << "pixel (" << width / 3 << ", " << y << ") of " << width;
    }
  }
}

TEST(EnvironmentSampler, LightFromADirectionComesFromTheTurnedDirection) {
  const OneThread quiet;
  const int n = 32;
  const PixelLight light = pixel_light(512, 300, 90);
  const EnvironmentSampler sampler(light.environment, n);
  Cubemap map(n);
  std::mt19937_64 random(3);
  for (int i = 0; i < 60; ++i) {
    const Rotation rotation = random_rotation(random);
    sampler.project(rotation, map);
    // Light lies nowhere but within a texel's diagonal and half a cell of where it should.
    for (int face = 0; face < 6; ++face) {
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          if (map.texels[cube_index(face, x, y, n)].r == 0) continue;
          const double off = length(cube_texel_center(face, x, y, n) - rotation * light.direction);
          ASSERT_LE(off, (std::sqrt(2.0) + 0.5) / n);
        }
      }
    }
  }
  sampler.project(rotation_y(kPi / 2), map);
  const auto brightest = std::max_element(map.texels.begin(), map.texels.end(),
                                          [](const Rgb& a, const Rgb& b) { return a.r < b.r; });
  const CubePoint p = cube_point(rotation_y(kPi / 2) * light.direction);
  EXPECT_EQ(static_cast<std::size_t>(brightest - map.texels.begin()),
            cube_index(p.face, cube_texel(p.u, n), cube_texel(p.v, n), n));
}

// A light handed to the nearest texel would jump; handed over by the share of a footprint that is w
// wide (in the same unit as the step, a cell is sqrt(4 pi / (16 * 6 n^2)) = 0.36 / n), a step of s
// moves at most s / w along each axis, sqrt(2) s / w in all.
TEST(EnvironmentSampler, ALightMovesSmoothly) {
  const OneThread quiet;
  const int n = 64;
  const PixelLight light = pixel_light(1024, 100, 200);
  const EnvironmentSampler sampler(light.environment, n);
  const std::vector<double> solid_angle = cube_solid_angles(n);
  const double step = 0.05 / n, width = 0.36 / n;
  Cubemap before(n), after(n);
  std::mt19937_64 random(4);
  double largest = 0;
  for (int i = 0; i < 4; ++i) {
    const Rotation start = random_rotation(random);
    sampler.project(start, before);
    for (int s = 1; s <= 40; ++s) {
      sampler.project(rotation_y(s * step) * start, after);
      double moved = 0;
      for (std::size_t k = 0; k < after.texels.size(); ++k) {
        moved += 0.5 *
                 std::abs(static_cast<double>(after.texels[k].r) -
                          static_cast<double>(before.texels[k].r)) *
                 solid_angle[k % solid_angle.size()];
      }
      largest = std::max(largest, moved / light.energy);
      std::swap(before, after);
    }
  }
  // A pixel is a cell here, up to half narrower than the nominal one.
  EXPECT_LE(largest, std::sqrt(2.0) * step / (0.5 * width));
  EXPECT_GT(largest, 0) << "some texel border was crossed";
}

/// A lobby: real where it is, else a soft gradient with a few windows and lamps of some pixels.
Environment lobby() {
  const char* given = std::getenv("HAARLIGHT_TEST_DATA");
  const fs::path file =
      (given ? fs::path(given) : fs::path(HAARLIGHT_SOURCE_DIR) / "../shared/data") /
      "environments/lobby.exr";
  if (fs::exists(file)) return load_environment(file);
  Image image(512, 256);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 512; ++x) {
      const float shade = 0.5f + 0.4f * static_cast<float>(std::sin(0.05 * x) * std::cos(0.03 * y));
      image.at(x, y) = {shade, shade * 0.9f, shade * 0.7f};
    }
  }
  std::mt19937 random(5);
  for (int lamp = 0; lamp < 12; ++lamp) {
    const int x0 = static_cast<int>(random() % 500), y0 = 40 + static_cast<int>(random() % 100);
    for (int y = y0; y < y0 + 4; ++y) {
      for (int x = x0; x < x0 + 4; ++x) image.at(x, y) = {300, 280, 200};
    }
  }
  return Environment(image);
}

TEST(EnvironmentSampler, AgreesWithBruteForceTexelAverages) {
  const int n = 32, samples = 16;
  const Environment environment = lobby();
  for (const Rotation& rotation : {Rotation{}, rotation_x(0.7) * rotation_y(2.1)}) {
    const Cubemap map = environment_to_cubemap(environment, n, rotation);
    const Rotation back = rotation.transposed();
    double squared_error = 0, squared = 0;
    for (int face = 0; face < 6; ++face) {
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) {
          RgbD mean;
          double total = 0;
          for (int j = 0; j < samples; ++j) {
            for (int i = 0; i < samples; ++i) {
              const double u = 2 * (x + (i + 0.5) / samples) / n - 1;
              const double v = 2 * (y + (j + 0.5) / samples) / n - 1;
              const double weight = std::pow(1 + u * u + v * v, -1.5);
              mean += weight * RgbD(environment.radiance(back * cube_direction({face, u, v})));
              total += weight;
            }
          }
          mean *= 1 / total;
          const RgbD d = RgbD(map.texels[cube_index(face, x, y, n)]) - mean;
          squared_error += d.r * d.r + d.g * d.g + d.b * d.b;
          squared += mean.r * mean.r + mean.g * mean.g + mean.b * mean.b;
        }
      }
    }
    // Cells stand for boxes of a third of a texel that are not turned: some per cent of a lamp's
    // light lands one texel off. 3.6 % was measured for the lobby at n = 64.
    EXPECT_LE(std::sqrt(squared_error / squared), 0.05);
  }
}

TEST(EnvironmentSampler, AllTheLightOfAPictureArrives) {
  const Environment environment = lobby();
  const Image& picture = environment.picture();
  double wanted = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      wanted += static_cast<double>(picture.at(x, y).r) * 2 * kPi / picture.width *
                (std::cos(kPi * y / picture.height) - std::cos(kPi * (y + 1) / picture.height));
    }
  }
  std::mt19937_64 random(6);
  for (const int n : {4, 16, 64}) {
    const EnvironmentSampler sampler(environment, n);
    const std::vector<double> solid_angle = cube_solid_angles(n);
    Cubemap map(n);
    for (int i = 0; i < 10; ++i) {
      sampler.project(random_rotation(random), map);
      // Where light is smooth it is averaged, uneven by 1 % a texel, which evens out in the sum.
      EXPECT_NEAR(energy(map, solid_angle) / wanted, 1, 0.003) << n;
    }
  }
}

TEST(EnvironmentSampler, AnyNumberOfThreadsGivesTheSameBits) {
  const Environment environment = lobby();
  const int before = thread_count();
  const Rotation rotation = rotation_x(0.3) * rotation_y(1);
  for (const int n : {4, 64}) {
    set_thread_count(1);
    const Cubemap one = environment_to_cubemap(environment, n, rotation);
    for (const int threads : {2, 7}) {
      set_thread_count(threads);
      EXPECT_TRUE(environment_to_cubemap(environment, n, rotation).texels == one.texels) << threads;
    }
  }
  set_thread_count(before);
}

TEST(EnvironmentSampler, ScalesWithTheLight) {
  const Environment environment = lobby();
  const Environment brighter(environment.picture(), {.projection = {}, .scale = 1 << 20});
  const Cubemap a = environment_to_cubemap(environment, 16, rotation_y(1));
  const Cubemap b = environment_to_cubemap(brighter, 16, rotation_y(1));
  for (std::size_t k = 0; k < a.texels.size(); ++k) {
    ASSERT_EQ(a.texels[k] * static_cast<float>(1 << 20), b.texels[k]) << "exact for powers of two";
  }
}

TEST(EnvironmentSampler, BlackIsBlack) {
  const Cubemap map = environment_to_cubemap(Environment(Image(32, 16)), 8, rotation_x(1));
  EXPECT_TRUE(
      std::all_of(map.texels.begin(), map.texels.end(), [](const Rgb& t) { return t == Rgb(); }));
}

TEST(EnvironmentSampler, RefusesWhatIsNoRotation) {
  const Environment environment(Image(8, 4));
  const EnvironmentSampler sampler(environment, 4);
  Cubemap map(4);
  EXPECT_THROW(sampler.project(rotation_y(std::nan("")), map), Error);
  EXPECT_THROW(sampler.project(rotation_y(HUGE_VAL), map), Error);
  Rotation stretched;
  stretched.row[1].y = 1.1;
  EXPECT_THROW(sampler.project(stretched, map), Error);
  EXPECT_NO_THROW(sampler.project(rotation_x(1e6), map));
}

TEST(EnvironmentSampler, RefusesWrongSizes) {
  const Environment environment(Image(32, 16));
  for (const int n : {-4, 0, 3, 48, 2048}) {
    EXPECT_THROW(EnvironmentSampler(environment, n), Error) << n;
  }
  Cubemap wrong(8);
  EXPECT_THROW(EnvironmentSampler(environment, 16).project({}, wrong), Error);
}

}  // namespace
}  // namespace haarlight
