// The inner loop of relighting: sums of a chunk += columns * deltas. Private to prt/ and bench/.

#pragma once

#include <cstdint>
#include <span>

#include "prt/transport.h"

namespace haarlight {

/// One column to be added, in RGB.
struct ColumnTask {
  ColumnBlocks blocks;
  double delta[3];
};

/// Rows of a chunk are [block][channel][row of block] doubles; 48 a block.
inline constexpr int kBlockTotals = 3 * kBlockRows;
inline constexpr int kChunkTotals = kChunkBlocks * kBlockTotals;

/// totals += sum over tasks of column * delta, each row adding its tasks in the order given. All
/// columns are of one chunk with the given rgb_blocks (4 words). Every task needs blocks.present.
/// Picks the version for the machine once; `apply_columns_portable` is the plain one, and what the
/// others are tested against.
void apply_columns(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                   double* totals);
void apply_columns_portable(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                            double* totals);

/// "avx2" or "portable".
const char* apply_kernel_name();

}  // namespace haarlight
