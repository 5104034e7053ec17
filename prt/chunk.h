// The bytes of a chunk: 64 tiles, column by column. Written by the assembler, read by everybody.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "prt/tile_codec.h"
#include "prt/transport.h"

namespace haarlight {

/// Layout of a chunk of N columns (little-endian, everything aligned to its size):
///   u64 rgb_blocks[4]     which of the 256 blocks are RGB, for all columns
///   u32 offset[N + 1]     column j is [offset[j], offset[j+1]) x 16 bytes from the chunk's start;
///                         an empty column has no bytes
///   padding to 16
///   per column            u64 present[4]; u16 scales[s], padded to 16; i8 values[16 s]
/// where s = grey blocks present + 3 x RGB blocks present.
inline constexpr std::size_t kChunkHeaderBytes = 32;

/// Bytes of a column with s scales.
constexpr std::size_t column_stream_bytes(std::size_t s) {
  return s == 0 ? 0 : 32 + ((2 * s + 15) / 16) * 16 + 16 * s;
}
/// First byte of the columns in a chunk of `columns` columns.
constexpr std::size_t column_area_begin(std::size_t columns) {
  return (kChunkHeaderBytes + 4 * (columns + 1) + 15) / 16 * 16;
}

/// Merges up to 64 compressed tiles (null: empty) into a chunk.
std::vector<std::byte> assemble_chunk(const HaarLayout& layout,
                                      std::span<const CompressedTile* const> tiles);

/// Says what is wrong with the structure of a chunk whose bytes came from outside, or nothing.
/// After an empty answer every column can be read without further checks.
std::string check_chunk(const HaarLayout& layout, std::span<const std::byte> chunk);

/// Column `index` of a chunk that passed check_chunk (or was assembled here).
ColumnBlocks chunk_column(const std::byte* chunk, int index);

}  // namespace haarlight
