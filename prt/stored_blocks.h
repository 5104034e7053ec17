// Going through the blocks that are stored of a column.

#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "prt/transport.h"

namespace haarlight {

/// Calls body(block, is_rgb, scales, values) for each block that `column` has of a chunk, in rising
/// order: block in [0, kChunkBlocks), scales and values those of ColumnBlocks, one and kBlockRows
/// of them, or three times as many if is_rgb. `rgb_blocks` is Transport::rgb_blocks of the chunk.
/// For passes that prepare something; what a frame streams goes through prt/apply_kernel.h.
template <typename Body>
void for_stored_blocks(const ColumnBlocks& column, const std::uint64_t* rgb_blocks,
                       const Body& body) {
  if (!column.present) return;
  const std::uint16_t* scales = column.scales;
  const std::int8_t* values = column.values;
  for (std::size_t word = 0; word < 4; ++word) {
    for (std::uint64_t bits = column.present[word]; bits; bits &= bits - 1) {
      const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
      const bool is_rgb = rgb_blocks[word] >> bit & 1;
      body(64 * word + bit, is_rgb, scales, values);
      scales += is_rgb ? 3 : 1;
      values += (is_rgb ? 3 : 1) * kBlockRows;
    }
  }
}

}  // namespace haarlight
