// Transports for tests of clustered PCA, and slow, plainly right products with what becomes of
// them.

#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "prt/tile_codec.h"
#include "prt/transport_writer.h"
#include "tests/prt/fixtures.h"
#include "wavelet/cubemap.h"

namespace haarlight::fixtures {

/// What vertices show without shadows: term k of a vertex of normal n has texels
/// max(0, n . w)^(1 + 3 k) dw. Vertices with `tints` have colours of their own; those below y =
/// `black_below` (of the unit normal) have no transport.
inline SmallTransport smooth_transport(int face, TransportMesh mesh, int terms, bool tints,
                                       double black_below = -2) {
  SmallTransport out = small_mesh_transport(face, std::move(mesh), 5, terms);
  const HaarLayout layout(face);
  const auto size = static_cast<std::size_t>(layout.size());
  const auto order = row_order(out.info);
  std::vector<Vec3> towards;
  std::vector<double> solid_angle;
  for (int f = 0; f < 6; ++f) {
    for (int y = 0; y < face; ++y) {
      for (int x = 0; x < face; ++x) {
        towards.push_back(cube_texel_center(f, x, y, face));
        solid_angle.push_back(cube_texel_solid_angle(x, y, face));
      }
    }
  }
  std::vector<float> texels(size);
  for (std::size_t t = 0; t < out.tiles.size(); ++t) {
    TileRows& tile = out.tiles[t];
    if (tile.values.empty()) continue;
    tile.rgb_blocks = 0;
    tile.values.assign(kTileRows * size, 0.0f);
    tile.color.assign(kTileRows, Rgb{1, 1, 1});
    for (std::size_t r = 0; r < kTileRows; ++r) {
      const std::uint32_t output = order[t * kTileRows + r];
      if (output == kNoOutput) continue;
      const std::size_t v = output / static_cast<std::size_t>(terms);
      const auto k = static_cast<int>(output % static_cast<std::size_t>(terms));
      const auto& n = out.info.mesh->normal[v];
      if (static_cast<double>(n[1]) < black_below) continue;
      for (std::size_t i = 0; i < size; ++i) {
        const double c = std::max(0.0, towards[i].x * static_cast<double>(n[0]) +
                                           towards[i].y * static_cast<double>(n[1]) +
                                           towards[i].z * static_cast<double>(n[2]));
        double lobe = c;
        for (int power = 0; power < 3 * k; ++power) lobe *= c;
        texels[i] = static_cast<float>(lobe * solid_angle[i]);
      }
      haar_forward(layout, std::span<const float>(texels),
                   std::span(tile.values).subspan(r * size, size));
      if (tints) {
        tile.color[r] = {0.2f + 0.1f * static_cast<float>(v % 7), 0.5f, v % 11 == 0 ? 0.0f : 0.8f};
      }
    }
  }
  return out;
}

/// The same of a bumpy sphere.
inline SmallTransport smooth_transport(int face, int vertices, int terms, bool tints,
                                       double black_below = -2) {
  return smooth_transport(face, bumpy_sphere(vertices, 5), terms, tints, black_below);
}

/// A transport's rows, dense, colours applied: [output][channel][coefficient].
inline std::vector<double> dense_rows(const Transport& transport) {
  const auto size = static_cast<std::size_t>(transport.layout().size());
  std::vector<double> out(3 * size * transport.info().output_count());
  for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
    const std::uint64_t* rgb = transport.rgb_blocks(chunk);
    for (std::size_t j = 0; j < size; ++j) {
      const ColumnBlocks blocks = transport.column(chunk, static_cast<int>(j));
      if (!blocks.present) continue;
      std::size_t next = 0;
      for (std::size_t b = 0; b < kChunkBlocks; ++b) {
        if (!(blocks.present[b / 64] >> (b % 64) & 1)) continue;
        const bool is_rgb = rgb[b / 64] >> (b % 64) & 1;
        for (std::size_t r = 0; r < kBlockRows; ++r) {
          const std::size_t row = static_cast<std::size_t>(chunk) * kChunkRows + b * kBlockRows + r;
          const std::uint32_t output = transport.row_output()[row];
          if (output == kNoOutput) continue;
          const RgbD color(transport.row_color()[row]);
          for (std::size_t ch = 0; ch < 3; ++ch) {
            const std::size_t at = next + (is_rgb ? ch : 0);
            out[(3 * output + ch) * size + j] =
                (ch == 0   ? color.r
                 : ch == 1 ? color.g
                           : color.b) *
                static_cast<double>(scale_from_bits(blocks.scales[at])) *
                static_cast<double>(blocks.values[at * kBlockRows + r]);
          }
        }
        next += is_rgb ? 3 : 1;
      }
    }
  }
  return out;
}

/// U of a transport of clusters from its vectors' sums P, [vertex][term].
inline std::vector<RgbD> combined(const TransportInfo& info, const std::vector<RgbD>& vectors) {
  const ClusterWeights& w = *info.clusters;
  const auto terms = static_cast<std::size_t>(info.terms);
  const auto begin = w.weight_begin();
  std::vector<RgbD> out(w.vertex.size() * terms);
  for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
    const std::size_t n = w.vertices_of(c), count = w.vectors_of(c);
    for (std::size_t v = 0; v < n; ++v) {
      const std::size_t place = w.first_vertex[c] + v;
      for (std::size_t k = 0; k < terms; ++k) {
        RgbD sum;
        for (std::size_t i = 0; i < count; ++i) {
          sum += vectors[w.first_vector[c] * terms + k * count + i] *
                 (static_cast<double>(w.scale[w.first_vector[c] + i]) *
                  w.weight[begin[c] + i * n + v]);
        }
        if (!w.tint.empty()) {
          sum = sum * RgbD(ClusterWeights::tint_of(w.tint[place * terms + k]));
        }
        out[w.vertex[place] * terms + k] = sum;
      }
    }
  }
  return out;
}

/// sqrt(sum |a - b|^2 / sum |b|^2).
inline double relative_difference(std::span<const RgbD> a, std::span<const RgbD> b) {
  double off = 0, all = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const RgbD d = a[i] - b[i];
    off += d.r * d.r + d.g * d.g + d.b * d.b;
    all += b[i].r * b[i].r + b[i].g * b[i].g + b[i].b * b[i].b;
  }
  return std::sqrt(off / all);
}

}  // namespace haarlight::fixtures
