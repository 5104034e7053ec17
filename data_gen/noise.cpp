// Smooth noise in space.

#include "data_gen/noise.h"

#include <cmath>
#include <cstdint>

#include "data_gen/random.h"

namespace haarlight::data_gen {
namespace {

double lattice(std::int64_t x, std::int64_t y, std::int64_t z) {
  const auto bits =
      mix_bits(static_cast<std::uint64_t>(x) ^
               mix_bits(static_cast<std::uint64_t>(y) ^ mix_bits(static_cast<std::uint64_t>(z))));
  return static_cast<double>(bits >> 11) * 0x1.0p-52 - 1.0;
}

double smooth(double t) { return t * t * (3 - 2 * t); }
double blend(double a, double b, double t) { return a + (b - a) * t; }

}  // namespace

double value_noise(const Vec3& point) {
  const double fx = std::floor(point.x), fy = std::floor(point.y), fz = std::floor(point.z);
  const auto x = static_cast<std::int64_t>(fx), y = static_cast<std::int64_t>(fy),
             z = static_cast<std::int64_t>(fz);
  const double tx = smooth(point.x - fx), ty = smooth(point.y - fy), tz = smooth(point.z - fz);
  const auto row = [&](std::int64_t yy, std::int64_t zz) {
    return blend(lattice(x, yy, zz), lattice(x + 1, yy, zz), tx);
  };
  return blend(blend(row(y, z), row(y + 1, z), ty), blend(row(y, z + 1), row(y + 1, z + 1), ty),
               tz);
}

double fractal_noise(const Vec3& point, int octaves) {
  double sum = 0, strength = 1;
  Vec3 p = point;
  for (int i = 0; i < octaves; ++i) {
    sum += strength * value_noise(p);
    strength *= 0.5;
    // The shift keeps the lattices of the layers from lining up at the origin.
    p = p * 2.0 + Vec3{17.3, 5.1, 31.7};
  }
  return sum;
}

}  // namespace haarlight::data_gen
