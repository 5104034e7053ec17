// Compresses the exact rows of one tile: blocks of 16 rows that matter, 8 bits an entry.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "prt/transport.h"
#include "prt/transport_writer.h"
#include "wavelet/haar.h"

namespace haarlight {

/// A tile's entries, column by column, blocks ascending inside a column. A grey block has one scale
/// and 16 values; an RGB block three of each, channel after channel.
struct CompressedTile {
  unsigned rgb_blocks = 0;
  std::vector<std::uint8_t> present;  ///< two columns a byte, low half first: which blocks are kept
  std::vector<std::uint16_t> scales;  ///< upper half of a float, >= 0
  std::vector<std::int8_t> values;    ///< entry = value * scale; in [-127, 127]
};

/// The float whose upper half is `bits`.
float scale_from_bits(std::uint16_t bits);
/// Smallest representable scale >= `scale` (finite, >= 0).
std::uint16_t scale_to_bits(float scale);

/// Drops every block whose root mean square entry (over its 16 rows, and channels) is below the
/// threshold of its band, and rounds the rest to 255 levels: |error| <= scale / 2, where
/// scale <= largest entry / 127 * (1 + 2^-7). Throws Error{invalid_argument} if shapes disagree or
/// an entry is not finite.
CompressedTile compress_tile(const HaarLayout& layout, const TileRows& rows,
                             std::span<const float> thresholds);

/// What the compressed tile stands for, in the shape of TileRows::values.
void decompress_tile(const HaarLayout& layout, const CompressedTile& tile,
                     std::vector<float>& values);

}  // namespace haarlight
