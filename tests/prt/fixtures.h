// Small transports and lightings for tests, and slow, plainly right products with them.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/rgb.h"
#include "prt/tile_codec.h"
#include "prt/transport.h"
#include "prt/transport_writer.h"
#include "tests/core/temporary_folder.h"

namespace haarlight::fixtures {

using haarlight::TemporaryFolder;

/// Rows whose entries fall off with the band and are about `density` full, some blocks RGB. Entries
/// differ from row to row, as no real transport's do: the worst case for the coder.
inline TileRows random_tile(const HaarLayout& layout, std::mt19937_64& random, double density,
                            bool colored) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto size = static_cast<std::size_t>(layout.size());
  TileRows tile;
  tile.rgb_blocks = colored ? static_cast<unsigned>(random() % 16) : 0;
  const std::size_t channels = tile.rgb_blocks ? 3 : 1;
  tile.values.resize(channels * kTileRows * size);
  for (std::size_t j = 0; j < size; ++j) {
    const double fall = std::exp2(-layout.band_of(static_cast<int>(j)));
    for (std::size_t block = 0; block < kTileBlocks; ++block) {
      const bool filled = uniform(random) < 2 * density - 1;
      for (std::size_t ch = 0; ch < (tile.rgb_blocks >> block & 1 ? 3u : 1u); ++ch) {
        for (std::size_t r = 0; r < kBlockRows; ++r) {
          tile.values[(ch * kTileRows + block * kBlockRows + r) * size + j] =
              filled ? static_cast<float>(0.1 * fall * uniform(random)) : 0.0f;
        }
      }
    }
  }
  for (std::size_t r = 0; r < kTileRows; ++r) {
    const auto part = [&] { return static_cast<float>(0.5 + 0.5 * uniform(random)); };
    const bool rgb = tile.rgb_blocks >> (r / kBlockRows) & 1;
    tile.color.push_back(rgb ? Rgb{1, 1, 1} : Rgb{part(), part(), part()});
    tile.coverage.push_back(part());
  }
  return tile;
}

/// Rows as real ones are: non-negative texel weights that add up to 1, so that a sky of radiance 1
/// gives a picture of 1, half of the texels shadowed at random; in wavelets.
inline TileRows unit_tile(const HaarLayout& layout, std::mt19937_64& random) {
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto size = static_cast<std::size_t>(layout.size());
  TileRows tile;
  tile.values.resize(kTileRows * size);
  std::vector<float> texels(size);
  for (std::size_t r = 0; r < kTileRows; ++r) {
    double sum = 0;
    for (float& t : texels) sum += t = std::max(0.0f, uniform(random) - 0.5f);
    for (float& t : texels) t = static_cast<float>(t / sum);
    haar_forward(layout, std::span<const float>(texels),
                 std::span(tile.values).subspan(r * size, size));
  }
  tile.color.assign(kTileRows, Rgb{1, 1, 1});
  tile.coverage.assign(kTileRows, 1.0f);
  return tile;
}

struct SmallTransport {
  TransportInfo info;
  std::vector<TileRows> tiles;  // with padding tiles empty
  std::vector<float> thresholds;
};

inline SmallTransport small_transport(int face, int width, int height, std::uint64_t seed,
                                      double density = 0.4, bool colored = true,
                                      float threshold = 0) {
  const HaarLayout layout(face);
  std::mt19937_64 random(seed);
  SmallTransport out;
  out.info.face_size = face;
  out.info.width = width;
  out.info.height = height;
  out.info.camera.width = width;
  out.info.camera.height = height;
  out.tiles.resize(image_row_order(width, height).size() / kTileRows);
  const auto real = static_cast<std::size_t>(((width + 7) / 8) * ((height + 7) / 8));
  for (std::size_t t = 0; t < real; ++t) {
    out.tiles[t] = random_tile(layout, random, density, colored);
  }
  out.thresholds.assign(static_cast<std::size_t>(layout.band_count()), threshold);
  return out;
}

/// A bumpy sphere of at least `vertices` vertices, (3, 2, -5) in its middle.
inline TransportMesh bumpy_sphere(int vertices, std::uint64_t seed) {
  const auto around = static_cast<std::uint32_t>(std::ceil(std::sqrt(2.0 * vertices)));
  const std::uint32_t down = around / 2 + 1;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0.8, 1.2);
  TransportMesh mesh;
  mesh.origin = {3, 2, -5};
  for (std::uint32_t j = 0; j < down; ++j) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const double a = 2 * kPi * i / around, b = kPi * (j + 0.5) / down, r = uniform(random);
      const Vec3 n{std::sin(b) * std::cos(a), std::cos(b), std::sin(b) * std::sin(a)};
      mesh.normal.push_back(
          {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
      mesh.position.push_back(
          {static_cast<float>(r * n.x), static_cast<float>(r * n.y), static_cast<float>(r * n.z)});
      if (j + 1 == down) continue;
      const std::uint32_t p = j * around + i, q = j * around + (i + 1) % around;
      mesh.triangle.push_back({p, q, p + around});
      mesh.triangle.push_back({q, q + around, p + around});
    }
  }
  return mesh;
}

/// The transport of a mesh, `terms` outputs a vertex.
inline SmallTransport small_mesh_transport(int face, TransportMesh mesh, std::uint64_t seed,
                                           int terms = 1, float threshold = 0) {
  const HaarLayout layout(face);
  std::mt19937_64 random(seed);
  SmallTransport out;
  out.info.kind = TransportKind::mesh;
  out.info.face_size = face;
  out.info.width = 32;
  out.info.height = 24;
  out.info.terms = terms;
  out.info.mesh = std::make_shared<const TransportMesh>(std::move(mesh));
  const BoundingSphere sphere = bounding_sphere(*out.info.mesh);
  out.info.camera = look_at(sphere.center + Vec3{0, 1, 3} * sphere.radius, sphere.center, 0.8,
                            out.info.width, out.info.height);
  const auto order = row_order(out.info);
  out.tiles.resize(order.size() / kTileRows);
  for (std::size_t t = 0; t < out.tiles.size(); ++t) {
    const auto first = order.begin() + static_cast<std::ptrdiff_t>(t * kTileRows);
    if (std::all_of(first, first + kTileRows, [](std::uint32_t o) { return o == kNoOutput; })) {
      continue;
    }
    out.tiles[t] = random_tile(layout, random, 0.4, true);
    out.tiles[t].coverage.assign(kTileRows, 1.0f);
  }
  out.thresholds.assign(static_cast<std::size_t>(layout.band_count()), threshold);
  return out;
}

/// T as stored (dropped and rounded), dense: [output][channel][coefficient], colours applied.
inline std::vector<double> dense(const SmallTransport& small) {
  const HaarLayout layout(small.info.face_size);
  const auto size = static_cast<std::size_t>(layout.size());
  const auto order = row_order(small.info);
  std::vector<double> out(3 * size * small.info.output_count());
  std::vector<float> values;
  for (std::size_t t = 0; t < small.tiles.size(); ++t) {
    if (small.tiles[t].values.empty()) continue;
    const CompressedTile compressed = compress_tile(layout, small.tiles[t], small.thresholds);
    decompress_tile(layout, compressed, values);
    for (std::size_t r = 0; r < kTileRows; ++r) {
      const std::uint32_t output = order[t * kTileRows + r];
      if (output == kNoOutput) continue;
      const bool rgb = compressed.rgb_blocks >> (r / kBlockRows) & 1;
      const RgbD color(small.tiles[t].color[r]);
      for (std::size_t ch = 0; ch < 3; ++ch) {
        const double c = ch == 0 ? color.r : ch == 1 ? color.g : color.b;
        for (std::size_t j = 0; j < size; ++j) {
          out[(3 * output + ch) * size + j] =
              c * static_cast<double>(values[((rgb ? ch : 0) * kTileRows + r) * size + j]);
        }
      }
    }
  }
  return out;
}

/// Random lighting: most coefficients small, a few large, some exactly zero.
inline std::vector<Rgb> random_lighting(const HaarLayout& layout, std::mt19937_64& random) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::vector<Rgb> out(static_cast<std::size_t>(layout.size()));
  for (Rgb& c : out) {
    const auto kind = random() % 8;
    const float size = kind == 0 ? 100.0f : kind == 1 ? 0.0f : 1.0f;
    c = {size * uniform(random), size * uniform(random), size * uniform(random)};
  }
  return out;
}

/// T * lighting in long double, one an output.
inline std::vector<RgbD> product(const std::vector<double>& dense, std::span<const Rgb> lighting) {
  const std::size_t size = lighting.size();
  std::vector<RgbD> out(dense.size() / (3 * size));
  for (std::size_t o = 0; o < out.size(); ++o) {
    long double sum[3] = {};
    for (std::size_t j = 0; j < size; ++j) {
      const float l[3] = {lighting[j].r, lighting[j].g, lighting[j].b};
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += static_cast<long double>(dense[(3 * o + c) * size + j]) *
                  static_cast<long double>(l[c]);
      }
    }
    out[o] = {static_cast<double>(sum[0]), static_cast<double>(sum[1]),
              static_cast<double>(sum[2])};
  }
  return out;
}

/// Random view factors for a mesh of so many vertices: profiles of sines and cosines vanish along
/// the normal, as those of a smooth function do. The last of the sets has one constant term.
inline ViewFactors random_view_factors(std::size_t vertices, int terms, std::uint64_t seed,
                                       int resolution = 9) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  constexpr int kSets = 3;
  constexpr int kOrders[5] = {0, 1, -1, 5, -4};
  ViewFactors f;
  f.terms = terms;
  f.resolution = resolution;
  for (int set = 0; set < kSets; ++set) {
    for (int k = 0; k < terms; ++k) {
      const bool last = set == kSets - 1;
      f.order.push_back(last ? 0 : kOrders[(k + set) % 5]);
      for (int i = 0; i < resolution; ++i) {
        const Rgb value{uniform(random), uniform(random), uniform(random)};
        f.profile.push_back(last                            ? Rgb{1, 1, 1} * (k == 0 ? 1.0f : 0.0f)
                            : i == 0 && f.order.back() != 0 ? Rgb{}
                                                            : value);
      }
    }
  }
  for (std::size_t v = 0; v < vertices; ++v)
    f.set_of.push_back(static_cast<std::uint32_t>(v % kSets));
  return f;
}

}  // namespace haarlight::fixtures
