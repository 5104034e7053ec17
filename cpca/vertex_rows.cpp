// Rows of a mesh's transport, taken out vertex by vertex.

#include "cpca/vertex_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

bool block_is_rgb(const Transport& transport, std::size_t row) {
  const std::size_t block = row / kBlock;
  const std::uint64_t* rgb = transport.rgb_blocks(static_cast<int>(block / kChunkBlocks));
  const std::size_t b = block % kChunkBlocks;
  return rgb[b / 64] >> (b % 64) & 1;
}

// One row that is wanted: where it is stored, where it goes, and its colour.
struct Wanted {
  std::uint32_t row;
  std::size_t to;
  Rgb color;
};

}  // namespace

VertexRows::VertexRows(Transport transport) : transport_(std::move(transport)) {
  if (transport_.kind() != TransportKind::mesh) {
    throw Error(ErrorKind::invalid_argument,
                transport_.kind() == TransportKind::image
                    ? "the transport is of one view, expected that of a mesh's vertices"
                    : "the transport is compressed already, expected that of a mesh's vertices");
  }
  vertices_ = transport_.info().mesh->position.size();
  row_of_.assign(transport_.info().output_count(), kNoOutput);
  rgb_.assign(vertices_, 0);
  const auto outputs = transport_.row_output();
  const auto count = static_cast<std::size_t>(terms());
  for (std::size_t row = 0; row < outputs.size(); ++row) {
    if (outputs[row] == kNoOutput) continue;
    row_of_[outputs[row]] = static_cast<std::uint32_t>(row);
    if (!block_is_rgb(transport_, row)) continue;
    rgb_[outputs[row] / count] = 1;
    any_rgb_ = true;
  }
}

float VertexRows::weight(std::size_t row) const {
  const Rgb c = transport_.row_color()[row];
  return std::sqrt((c.r * c.r + c.g * c.g + c.b * c.b) / 3);
}

Rgb VertexRows::tint(std::size_t vertex, int term) const {
  const std::size_t output =
      vertex * static_cast<std::size_t>(terms()) + static_cast<std::size_t>(term);
  const std::uint32_t row = row_of_[output];
  if (row == kNoOutput || block_is_rgb(transport_, row)) return {1, 1, 1};
  const float length = weight(row);
  if (length == 0) return {1, 1, 1};
  const Rgb c = transport_.row_color()[row];
  return {c.r / length, c.g / length, c.b / length};
}

std::size_t VertexRows::point_size(int channels) const {
  return static_cast<std::size_t>(terms()) * static_cast<std::size_t>(channels) *
         static_cast<std::size_t>(transport_.layout().size());
}

void VertexRows::read(std::span<const std::uint32_t> vertices, int channels,
                      std::vector<float>& out) const {
  const auto size = static_cast<std::size_t>(transport_.layout().size());
  const auto count = static_cast<std::size_t>(terms());
  const auto three = static_cast<std::size_t>(channels);
  out.assign(vertices.size() * point_size(channels), 0.0f);

  // By where rows are stored, so that each column of a chunk is walked once.
  std::vector<Wanted> wanted;
  wanted.reserve(vertices.size() * count);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint32_t row = row_of_[vertices[i] * count + k];
      if (row == kNoOutput) continue;
      Rgb color = transport_.row_color()[row];
      if (channels == 1) color.r = weight(row);
      wanted.push_back({row, (i * count + k) * three * size, color});
    }
  }
  std::sort(wanted.begin(), wanted.end(),
            [](const Wanted& a, const Wanted& b) { return a.row < b.row; });

  for (std::size_t first = 0; first < wanted.size();) {
    const std::size_t chunk = wanted[first].row / kChunkRows;
    std::size_t end = first;
    while (end < wanted.size() && wanted[end].row / kChunkRows == chunk) ++end;
    const std::uint64_t* rgb = transport_.rgb_blocks(static_cast<int>(chunk));
    for (std::size_t j = 0; j < size; ++j) {
      const ColumnBlocks column = transport_.column(static_cast<int>(chunk), static_cast<int>(j));
      if (!column.present) continue;
      std::size_t before[4];  // scales of the words before
      std::size_t scales = 0;
      for (std::size_t w = 0; w < 4; ++w) {
        before[w] = scales;
        scales += static_cast<std::size_t>(std::popcount(column.present[w]) +
                                           2 * std::popcount(column.present[w] & rgb[w]));
      }
      std::size_t at = 0, last_block = kChunkBlocks;
      for (std::size_t i = first; i < end; ++i) {
        const std::size_t block = wanted[i].row % kChunkRows / kBlock;
        const std::size_t w = block / 64;
        const std::uint64_t bit = std::uint64_t{1} << (block % 64);
        if (!(column.present[w] & bit)) continue;
        if (block != last_block) {
          const std::uint64_t lower = column.present[w] & (bit - 1);
          at = before[w] +
               static_cast<std::size_t>(std::popcount(lower) + 2 * std::popcount(lower & rgb[w]));
          last_block = block;
        }
        const std::size_t r = wanted[i].row % kBlock;
        float* to = out.data() + wanted[i].to + j;
        const auto value = [&](std::size_t scale) {
          return scale_from_bits(column.scales[scale]) *
                 static_cast<float>(column.values[scale * kBlock + r]);
        };
        const Rgb& color = wanted[i].color;
        if (channels == 1) {
          to[0] = value(at) * color.r;
        } else if (rgb[w] & bit) {
          to[0] = value(at);
          to[size] = value(at + 1);
          to[2 * size] = value(at + 2);
        } else {
          const float grey = value(at);
          to[0] = grey * color.r;
          to[size] = grey * color.g;
          to[2 * size] = grey * color.b;
        }
      }
    }
    first = end;
  }
}

}  // namespace haarlight
