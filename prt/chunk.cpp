// Chunk assembly and checking.

#include "prt/chunk.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

namespace haarlight {
namespace {

template <typename T>
T load(const std::byte* from) {
  T value;
  std::memcpy(&value, from, sizeof value);
  return value;
}

std::size_t scale_count(const std::uint64_t* present, const std::uint64_t* rgb) {
  std::size_t s = 0;
  for (int w = 0; w < 4; ++w) {
    s += static_cast<std::size_t>(std::popcount(present[w]) +
                                  2 * std::popcount(present[w] & rgb[w]));
  }
  return s;
}

}  // namespace

std::vector<std::byte> assemble_chunk(const HaarLayout& layout,
                                      std::span<const CompressedTile* const> tiles) {
  const auto columns = static_cast<std::size_t>(layout.size());
  std::uint64_t rgb[4] = {};
  std::size_t scales_total = 0;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    if (!tiles[t]) continue;
    rgb[t / 16] |= static_cast<std::uint64_t>(tiles[t]->rgb_blocks) << (4 * (t % 16));
    scales_total += tiles[t]->scales.size();
  }
  std::vector<std::byte> chunk;
  chunk.reserve(column_area_begin(columns) + 18 * scales_total + 48 * columns);
  chunk.resize(column_area_begin(columns));
  std::memcpy(chunk.data(), rgb, sizeof rgb);

  std::vector<std::size_t> next(tiles.size(), 0);  // per tile: scales consumed so far
  const auto put_offset = [&](std::size_t column) {
    const auto offset = static_cast<std::uint32_t>(chunk.size() / 16);
    std::memcpy(chunk.data() + kChunkHeaderBytes + 4 * column, &offset, 4);
  };
  for (std::size_t column = 0; column < columns; ++column) {
    put_offset(column);
    std::uint64_t present[4] = {};
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      if (!tiles[t]) continue;
      const std::uint64_t bits = tiles[t]->present[column / 2] >> (4 * (column % 2)) & 15u;
      present[t / 16] |= bits << (4 * (t % 16));
    }
    const std::size_t s = scale_count(present, rgb);
    if (s == 0) continue;
    const std::size_t begin = chunk.size();
    chunk.resize(begin + column_stream_bytes(s));
    std::memcpy(chunk.data() + begin, present, sizeof present);
    std::byte* scales = chunk.data() + begin + 32;
    std::byte* values = chunk.data() + begin + column_stream_bytes(s) - 16 * s;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      if (!tiles[t]) continue;
      const std::uint64_t bits = present[t / 16] >> (4 * (t % 16)) & 15u;
      const auto count = static_cast<std::size_t>(std::popcount(bits) +
                                                  2 * std::popcount(bits & tiles[t]->rgb_blocks));
      if (count == 0) continue;
      std::memcpy(scales, tiles[t]->scales.data() + next[t], 2 * count);
      std::memcpy(values, tiles[t]->values.data() + 16 * next[t], 16 * count);
      scales += 2 * count;
      values += 16 * count;
      next[t] += count;
    }
  }
  put_offset(columns);
  return chunk;
}

std::string check_chunk(const HaarLayout& layout, std::span<const std::byte> chunk) {
  const auto columns = static_cast<std::size_t>(layout.size());
  const std::size_t area = column_area_begin(columns);
  if (chunk.size() < area || chunk.size() % 16 != 0) {
    return fmt::format("chunk of {} bytes, expected at least {} in steps of 16", chunk.size(),
                       area);
  }
  std::uint64_t rgb[4];
  std::memcpy(rgb, chunk.data(), sizeof rgb);
  const std::byte* offsets = chunk.data() + kChunkHeaderBytes;
  std::size_t expected = area;
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t begin = std::size_t{16} * load<std::uint32_t>(offsets + 4 * column);
    const std::size_t end = std::size_t{16} * load<std::uint32_t>(offsets + 4 * column + 4);
    if (begin != expected || end < begin || end > chunk.size()) {
      return fmt::format("column {} at bytes {} to {}, expected to begin at {} inside {}", column,
                         begin, end, expected, chunk.size());
    }
    expected = end;
    if (begin == end) continue;
    if (end - begin < 64) return fmt::format("column {} has {} bytes", column, end - begin);
    std::uint64_t present[4];
    std::memcpy(present, chunk.data() + begin, sizeof present);
    const std::size_t s = scale_count(present, rgb);
    if (column_stream_bytes(s) != end - begin) {
      return fmt::format("column {} has {} bytes, its blocks need {}", column, end - begin,
                         column_stream_bytes(s));
    }
    for (std::size_t i = 0; i < s; ++i) {
      const auto scale = load<std::uint16_t>(chunk.data() + begin + 32 + 2 * i);
      if (scale >= 0x7f80) return fmt::format("column {} has a scale that is no number", column);
    }
  }
  if (expected != chunk.size()) {
    return fmt::format("columns end at byte {} of {}", expected, chunk.size());
  }
  return {};
}

ColumnBlocks chunk_column(const std::byte* chunk, int index) {
  const std::byte* offset = chunk + kChunkHeaderBytes + 4 * static_cast<std::size_t>(index);
  const auto begin = load<std::uint32_t>(offset), end = load<std::uint32_t>(offset + 4);
  if (begin == end) return {};
  const std::byte* column = chunk + std::size_t{16} * begin;
  // 16-byte columns inside page-aligned chunks: the casts are aligned.
  ColumnBlocks blocks;
  blocks.present = reinterpret_cast<const std::uint64_t*>(column);
  blocks.scales = reinterpret_cast<const std::uint16_t*>(column + 32);
  // Size = 32 + pad16(2 s) + 16 s fixes s: with q = size/16 - 2 units, s + ceil(s/8) = q.
  const std::size_t units = end - begin - 2;
  const std::size_t s = units - (units + 8) / 9;
  blocks.values = reinterpret_cast<const std::int8_t*>(chunk + std::size_t{16} * end - 16 * s);
  blocks.bytes = 16 * (end - begin);
  return blocks;
}

}  // namespace haarlight
