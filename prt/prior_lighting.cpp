// Procedural grey environments, sampled straight onto the cube map.

#include "prt/prior_lighting.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>

#include "core/vec.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

// A number in [0, 1) from integers alone, the same everywhere (splitmix64's finaliser).
double hash01(std::uint64_t a, std::uint64_t b = 0, std::uint64_t c = 0) {
  std::uint64_t x =
      a * 0x9e3779b97f4a7c15ull + b * 0xbf58476d1ce4e5b9ull + c * 0x94d049bb133111ebull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

// Value noise on a lattice of `frequency` cells a unit, in [0, 1].
double noise(const Vec3& p, double frequency, std::uint64_t seed) {
  const Vec3 q = p * frequency;
  const double fx = std::floor(q.x), fy = std::floor(q.y), fz = std::floor(q.z);
  const auto smooth = [](double t) { return t * t * (3 - 2 * t); };
  const double tx = smooth(q.x - fx), ty = smooth(q.y - fy), tz = smooth(q.z - fz);
  const auto at = [&](int dx, int dy, int dz) {
    const auto lattice = [](double v, int d) {
      return static_cast<std::uint64_t>(static_cast<std::int64_t>(v) + d + 4096);
    };
    return hash01(lattice(fx, dx) * 8192 + lattice(fy, dy), lattice(fz, dz), seed);
  };
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    sum += at(dx, dy, dz) * (dx ? tx : 1 - tx) * (dy ? ty : 1 - ty) * (dz ? tz : 1 - tz);
  }
  return sum;
}

Vec3 direction_of(double elevation, double azimuth) {
  return {std::cos(elevation) * std::cos(azimuth), std::sin(elevation),
          std::cos(elevation) * std::sin(azimuth)};
}

using Radiance = std::function<double(const Vec3&)>;

// Sky, brighter at the horizon, over a darker ground; a sun of 1.2 degrees carrying about 60 % of
// the light, as measured in clear-sky probes of one thousand pixels.
Radiance sun_and_sky(double elevation) {
  const Vec3 sun = direction_of(elevation, 0.7);
  return [=](const Vec3& d) {
    const double sky = d.y > 0 ? 0.35 + 0.4 * std::pow(1 - d.y, 4) : 0.15;
    return sky + (dot(d, sun) > std::cos(0.0209) ? 3000.0 : 0.0);
  };
}

// Dim walls with blotches and `lamps` lamps of 1 to 3 degrees, about half of the light theirs.
Radiance lamps_in_a_room(int lamps, double lowest_elevation, double wall, std::uint64_t seed) {
  struct Lamp {
    Vec3 direction;
    double cosine, radiance;
  };
  std::vector<Lamp> all;
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(lamps); ++i) {
    const double half_angle = 0.009 + 0.017 * hash01(i, 1, seed);
    all.push_back({direction_of(lowest_elevation + (1.3 - lowest_elevation) * hash01(i, 2, seed),
                                2 * kPi * hash01(i, 3, seed)),
                   std::cos(half_angle), 30 + 270 * hash01(i, 4, seed)});
  }
  return [=](const Vec3& d) {
    double sum = wall * (0.3 + noise(d, 2.3, seed) + 0.5 * noise(d, 7, seed + 1));
    for (const Lamp& lamp : all) {
      if (dot(d, lamp.direction) > lamp.cosine) sum += lamp.radiance;
    }
    return sum;
  };
}

Radiance windows() {
  return [](const Vec3& d) {
    const double azimuth = std::atan2(d.x, -d.z) / (2 * kPi) + 0.5, elevation = std::asin(d.y);
    const double across = azimuth * 9 - std::floor(azimuth * 9);
    const bool pane = elevation > 0.1 && elevation < 0.6 && across > 0.25 && across < 0.6 &&
                      azimuth > 0.2 && azimuth < 0.7;
    return 0.1 + 0.1 * noise(d, 3, 21) + (pane ? 6.0 + 4.0 * noise(d, 9, 22) : 0.0);
  };
}

Radiance clouds() {
  return [](const Vec3& d) {
    const double cover = 0.6 * noise(d, 2, 31) + 0.3 * noise(d, 5, 32) + 0.15 * noise(d, 12, 33);
    return d.y > 0 ? 0.4 + 1.5 * cover : 0.2 + 0.2 * noise(d, 8, 34);
  };
}

Radiance leaves() {
  return [](const Vec3& d) {
    const double gap = noise(d, 18, 41) * noise(d, 6, 42);
    return 0.1 + 0.3 * noise(d, 4, 43) + (d.y > 0.1 && gap > 0.45 ? 12.0 : 0.0);
  };
}

std::vector<float> coefficients_of(const HaarLayout& layout, const Radiance& radiance) {
  const int n = layout.face_size();
  // As many samples as resolve a lamp of a degree, whatever the face size.
  const int samples = std::max(2, 256 / n);
  std::vector<float> texels(static_cast<std::size_t>(layout.size())), out(texels.size());
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        double sum = 0;
        for (int sy = 0; sy < samples; ++sy) {
          for (int sx = 0; sx < samples; ++sx) {
            const double u = 2 * (x + (sx + 0.5) / samples) / n - 1;
            const double v = 2 * (y + (sy + 0.5) / samples) / n - 1;
            sum += radiance(cube_direction({face, u, v}));
          }
        }
        texels[cube_index(face, x, y, n)] = static_cast<float>(sum / (samples * samples));
      }
    }
  }
  haar_forward(layout, std::span<const float>(texels), out);
  return out;
}

std::vector<std::vector<float>> make_lightings(const HaarLayout& layout) {
  std::vector<std::vector<float>> all;
  for (const Radiance& radiance :
       {sun_and_sky(0.9), sun_and_sky(0.35), lamps_in_a_room(24, 0.1, 0.3, 11),
        lamps_in_a_room(8, -0.5, 0.15, 12), windows(), lamps_in_a_room(1, 0.8, 0.02, 13), clouds(),
        leaves()}) {
    all.push_back(coefficients_of(layout, radiance));
  }
  return all;
}

}  // namespace

const std::vector<std::vector<float>>& prior_lightings(const HaarLayout& layout) {
  // A quarter of a second to make, so each size is made once.
  static std::mutex mutex;
  static std::map<int, std::vector<std::vector<float>>> made;
  const std::lock_guard lock(mutex);
  auto& entry = made[layout.face_size()];
  if (entry.empty()) entry = make_lightings(layout);
  return entry;
}

}  // namespace haarlight
