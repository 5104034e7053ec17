// Rows 13 to 19: the basis, the cube, rotations, selection and rounding to 8 bits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "prt/image_relighter.h"
#include "prt/motion.h"
#include "prt/tile_codec.h"
#include "tests/hard/hard_case.h"
#include "tests/hard/oracle.h"
#include "wavelet/cubemap.h"
#include "wavelet/top_k.h"

namespace haarlight {
namespace {

using namespace hard;

constexpr double u = 0x1p-24, v = 0x1p-53;

TEST(HardCases, Row13_SunBesideDarkTexel) {
  property("round trip of a sun of 1e6 beside 1e-3: within 24 log2 R u max; light through doubles");
  // Each level adds 4 values twice a way: at most 12 roundings forth and 12 back of what the sun
  // puts in. Light is transformed in double and each of its 3 log2 R + 1 coefficients rounded once,
  // none of them above half of the sun: (3 log2 R + 1) u 1e6 / 2.
  double of_bound = 0, of_light = 0;
  for (const int n : {8, 64, 256}) {
    const HaarLayout layout(n);
    const double levels = std::log2(n);
    const auto size = static_cast<std::size_t>(layout.size());
    for (const std::size_t sun : {std::size_t{0}, size / 2 + 3, size - 1}) {
      std::vector<float> texels(size, 0.001f), c(size), back(size);
      texels[sun] = 1e6f;
      haar_forward(layout, std::span<const float>(texels), c);
      haar_inverse(layout, std::span<const float>(c), back);
      std::vector<Rgb> light(size), light_c(size), light_back(size);
      for (std::size_t k = 0; k < size; ++k) light[k] = {texels[k], texels[k], texels[k]};
      haar_forward(layout, std::span<const Rgb>(light), light_c);
      haar_inverse(layout, std::span<const Rgb>(light_c), light_back);
      for (std::size_t k = 0; k < size; ++k) {
        const double right = static_cast<double>(texels[k]);
        const double error = std::abs(static_cast<double>(back[k]) - right);
        const double error_of_light = std::abs(static_cast<double>(light_back[k].g) - right);
        of_bound = std::max(of_bound, error / (24 * levels * u * 1e6));
        of_light = std::max(of_light, error_of_light / ((3 * levels + 1) * u * 0.5e6));
      }
    }
  }
  at_most("floats: of the bound", of_bound, 1);
  at_most("light: of its bound", of_light, 1);
}

TEST(HardCases, Row14_TiedKeys) {
  property("equal keys: the choice is that of (key, index) order, whatever was chosen before");
  std::mt19937_64 random(1);
  TopK used;  // keeps scratch from call to call
  double wrong = 0;
  for (int round = 0; round < 300; ++round) {
    std::vector<float> keys(1 + random() % 3000);
    const int values = 1 + static_cast<int>(random() % 6);  // ties everywhere
    for (float& key : keys) key = static_cast<float>(random() % static_cast<unsigned>(values));
    const int k = 1 + static_cast<int>(random() % keys.size());
    std::vector<int> order(keys.size()), chosen;
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return keys[static_cast<std::size_t>(a)] > keys[static_cast<std::size_t>(b)];
    });
    std::vector<int> right;
    for (const int i : order) {
      if (static_cast<int>(right.size()) < k && keys[static_cast<std::size_t>(i)] > 0) {
        right.push_back(i);
      }
    }
    std::sort(right.begin(), right.end());
    used.select(keys, k, chosen);
    wrong += chosen != right;
  }
  // And in trackers: light of one value everywhere, two trackers with different pasts.
  const HaarLayout layout(8);
  const std::vector<Rgb> even(static_cast<std::size_t>(layout.size()), Rgb{1, 1, 1});
  LightingOptions options = options_of(LightingMethod::nwa, 37);
  options.weights.assign(even.size(), 1.0f);
  LightingTracker fresh(layout, options), old(layout, options);
  for (int frame = 0; frame < 5; ++frame) old.advance(fixtures::random_lighting(layout, random));
  const LightingUpdate a = fresh.advance(even), b = old.advance(even);
  for (std::size_t i = 0; i < a.deltas.size(); ++i) {
    wrong += a.deltas[i].index != static_cast<int>(i);
  }
  at_most("wrong choices", wrong + (a.deltas != b.deltas), 0);
}

TEST(HardCases, Row15_CubeSeams) {
  property(
      "26 directions of faces, edges, corners +-1 ulp find texels; |dB| <= |T| |dL| across seams");
  const auto moved = [](double value, int ulps) {
    return ulps == 0 ? value : std::nextafter(value, ulps > 0 ? 1e300 : -1e300);
  };
  double outside = 0, apart = 0;
  for (int code = 0; code < 27; ++code) {
    const Vec3 base{code % 3 - 1.0, code / 3 % 3 - 1.0, code / 9 - 1.0};
    if (base == Vec3{}) continue;
    for (int nudge = 0; nudge < 27; ++nudge) {
      const Vec3 d{moved(base.x, nudge % 3 - 1), moved(base.y, nudge / 3 % 3 - 1),
                   moved(base.z, nudge / 9 - 1)};
      const CubePoint p = cube_point(d);
      outside += !(std::abs(p.u) <= 1 && std::abs(p.v) <= 1 && p.face >= 0 && p.face < 6);
      for (const int n : {1, 8, 64, 1024}) {
        const int x = cube_texel(p.u, n), y = cube_texel(p.v, n);
        outside += !(x >= 0 && x < n && y >= 0 && y < n);
      }
      apart = std::max(apart, length(cube_direction(p) - normalize(d)));
    }
  }
  at_most("directions outside", outside, 0);
  // Each component is rounded by a division and by normalising: some v.
  at_most("direction found again within", apart, 8 * v);

  // A disc of radius 0.15 over black goes across edges and round corners in steps of 1e-3 rad.
  // Where it is, a texel is at least 2 / 8 / sqrt(6) = 0.1 wide (at the corners of the cube), so a
  // step carries at most 1e-3 / 0.1 of the light over each of two borders of its texel, out of one
  // and into another: 4e-2 of it. The radiance that comes out is within 2 % of the energy.
  Image disc(256, 128);
  for (int y = 0; y < disc.height; ++y) {
    for (int x = 0; x < disc.width; ++x) {
      const auto d = projection_direction(Projection::latlong, (x + 0.5) / disc.width,
                                          (y + 0.5) / disc.height);
      if (d && std::acos(std::clamp(d->z, -1.0, 1.0)) < 0.15) disc.at(x, y) = {10, 20, 30};
    }
  }
  const HaarLayout layout(8);
  const EnvironmentSampler sampler(Environment(disc), 8);
  const std::vector<double> solid_angle = cube_solid_angles(8);
  const fixtures::SmallTransport small = small_case(17);
  const std::vector<double> t = fixtures::dense(small);
  const auto size = static_cast<std::size_t>(layout.size());
  std::vector<double> row_norm;
  for (std::size_t row = 0; row < t.size() / size; ++row) {
    double sum = 0;
    for (std::size_t j = 0; j < size; ++j) sum += t[row * size + j] * t[row * size + j];
    row_norm.push_back(std::sqrt(sum));
  }
  Chain chain(small, options_of(LightingMethod::reference, 1));
  Cubemap map(8);
  std::vector<Rgb> light(size), before_light;
  std::vector<double> before;
  std::vector<Rgb> before_texels;
  double jump = 0, of_product = 0;
  for (int step = 0; step < 2400; ++step) {
    // 3.6 rad about an axis that leads over edges, a corner and two poles' neighbourhoods.
    const double a = 1e-3 * step;
    sampler.project(rotation_x(0.7 * std::sin(a)) * rotation_y(1.5 * a), map);
    haar_forward(layout, std::span<const Rgb>(map.texels), light);
    chain.advance(light);
    const std::vector<double> now = outputs(chain.sums);
    if (step > 0) {
      double moved_energy = 0, energy = 0, change = 0, size_of_light = 0;
      for (std::size_t k = 0; k < size; ++k) {
        const double w = solid_angle[k % 64];
        energy += w * static_cast<double>(map.texels[k].g);
        moved_energy += w * std::abs(static_cast<double>(map.texels[k].g) -
                                     static_cast<double>(before_texels[k].g));
        const double d = static_cast<double>(light[k].g) - static_cast<double>(before_light[k].g);
        change += d * d;
        size_of_light += static_cast<double>(light[k].g) * static_cast<double>(light[k].g);
      }
      // 1.5 e-3 rad of turn a step and 0.7e-3 of tilt.
      jump = std::max(jump, moved_energy / energy);
      for (std::size_t i = 1; i < now.size(); i += 3) {
        // Cauchy-Schwarz, and what the sums may have rounded by.
        const double allowed =
            row_norm[i] * (std::sqrt(change) + 2 * 384 * 2400.0 * v * std::sqrt(size_of_light));
        of_product = std::max(of_product, std::abs(now[i] - before[i]) / allowed);
      }
    }
    before = now, before_texels = map.texels, before_light = light;
  }
  at_most("light that moves in a step", jump, 2.2 * 4e-2 + 0.02);
  at_most("|dB| of |T| |dL|", of_product, 1);
}

TEST(HardCases, Row16_TexelSolidAngle) {
  property("every texel's solid angle within 1e-9 of the corner formula in long double");
  // The formula loses 4 / (solid angle) of 2^-64: 2e-12 at R = 1024.
  const auto corner = [](int i, int j, int n) {
    const long double a = 2.0L * i / n - 1, b = 2.0L * j / n - 1;
    return std::atan2(a * b, std::sqrt(1 + a * a + b * b));
  };
  double worst = 0;
  for (const int n : {8, 64, 256, 1024}) {
    const std::vector<double> face = cube_solid_angles(n);
    for (int y = 0; y < n / 2; ++y) {
      for (int x = y; x < n / 2; ++x) {
        const long double exact =
            corner(x + 1, y + 1, n) - corner(x, y + 1, n) - corner(x + 1, y, n) + corner(x, y, n);
        const double found = face[static_cast<std::size_t>(y * n + x)];
        worst = std::max(worst, static_cast<double>(std::abs(found / exact - 1)));
      }
    }
    const double sum = std::accumulate(face.begin(), face.end(), 0.0);
    worst = std::max(worst, std::abs(6 * sum / (4 * kPi) - 1));
  }
  at_most("relative error", worst, 1e-9);
}

TEST(HardCases, Row17_WeightedHaar) {
  property("|sum c^2 - sum x^2| <= 12 log2 R u sum x^2; solid angles fold into T once: sum = 4 pi");
  std::mt19937_64 random(2);
  std::uniform_real_distribution<float> uniform(-1, 1);
  double of_bound = 0, of_sphere = 0;
  for (const int n : {8, 64, 256}) {
    const HaarLayout layout(n);
    const auto size = static_cast<std::size_t>(layout.size());
    const std::vector<double> solid_angle = cube_solid_angles(n);
    std::vector<float> x(size), c(size), weighted(size), one(size, 1.0f), tc(size), lc(size);
    for (std::size_t k = 0; k < size; ++k) {
      const double w = solid_angle[k % (size / 6)];
      x[k] = uniform(random) * static_cast<float>(std::sqrt(w));
      weighted[k] = static_cast<float>(w);
    }
    haar_forward(layout, std::span<const float>(x), c);
    double texels = 0, coefficients = 0;
    for (std::size_t k = 0; k < size; ++k) {
      texels += static_cast<double>(x[k]) * static_cast<double>(x[k]);
      coefficients += static_cast<double>(c[k]) * static_cast<double>(c[k]);
    }
    const double bound = 12 * std::log2(n) * u;
    of_bound = std::max(of_bound, std::abs(coefficients - texels) / (bound * texels));
    haar_forward(layout, std::span<const float>(weighted), tc);
    haar_forward(layout, std::span<const float>(one), lc);
    double sphere = 0;
    for (std::size_t k = 0; k < size; ++k) {
      sphere += static_cast<double>(tc[k]) * static_cast<double>(lc[k]);
    }
    of_sphere = std::max(of_sphere, std::abs(sphere / (4 * kPi) - 1) / bound);
  }
  at_most("Parseval: of the bound", of_bound, 1);
  at_most("sphere: of the bound", of_sphere, 1);
}

TEST(HardCases, Row18_RotationsOfAMillionFrames) {
  property("|R R^T - I| <= 3u in every one of 10^6 frames; ours, from angles in double, 8 v");
  // An entry is a sum of three products of entries that are each two roundings off.
  double worst = 0;
  for (const MotionKind kind : {MotionKind::rotate, MotionKind::tumble, MotionKind::swing}) {
    const MotionOptions options{.kind = kind, .degrees = 3.6e5, .stop = 1000000};
    for (int frame = 0; frame <= 1000000; frame += kind == MotionKind::tumble ? 1 : 7) {
      const Rotation r = motion_rotation(options, frame);
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          worst = std::max(worst, std::abs(dot(r.row[i], r.row[j]) - (i == j ? 1.0 : 0.0)));
        }
      }
    }
  }
  at_most("|R R^T - I|", worst, 8 * v);
}

TEST(HardCases, Row19_QuantisedConstantBand) {
  property("8 bits: error <= step / 2 for constant, zero, tiny and huge bands; no NaN");
  const HaarLayout layout(8);
  double of_step = 0, bad = 0;
  for (const float value : {0.0f, 1.0f, -0.3f, 1e-29f, -1e-33f, 1e-45f, 3e15f}) {
    TileRows tile;
    tile.values.assign(kTileRows * static_cast<std::size_t>(layout.size()), value);
    tile.color.assign(kTileRows, Rgb{1, 1, 1});
    tile.coverage.assign(kTileRows, 1.0f);
    const CompressedTile compressed = compress_tile(layout, tile, std::vector<float>(3, 0.0f));
    std::vector<float> back;
    decompress_tile(layout, compressed, back);
    // A block's scale is its peak / 127, rounded up to 8 bits. What is below 1e-30 is dropped.
    const double step = std::max(std::abs(static_cast<double>(value)) / 127 * (1 + 0x1p-7), 2e-30);
    for (std::size_t i = 0; i < back.size(); ++i) {
      bad += !std::isfinite(back[i]);
      of_step = std::max(
          of_step, std::abs(static_cast<double>(back[i]) - static_cast<double>(value)) / step);
    }
    if (value == 0) bad += static_cast<double>(compressed.values.size());
  }
  at_most("error of step", of_step, 0.5);
  at_most("NaN, or bytes spent on zeros", bad, 0);
}

}  // namespace
}  // namespace haarlight
