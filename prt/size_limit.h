// Keeping a transport below a size: which further blocks to drop. Private to prt/.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "prt/tile_codec.h"
#include "wavelet/haar.h"

namespace haarlight {

/// Candidate thresholds, ascending: 0, then steps of 2^(1/8) over all that entries of a transport
/// are.
inline constexpr int kLimitLevels = 256;
float limit_threshold(int level);

/// Drops stored blocks whose root mean square entry, as stored, is below `threshold`.
void prune_tile(const HaarLayout& layout, float threshold, CompressedTile& tile);

/// Bytes that chunks would have if their tiles were pruned at each level.
class SizeByThreshold {
 public:
  explicit SizeByThreshold(const HaarLayout& layout)
      : columns_(static_cast<std::size_t>(layout.size())) {}
  /// The tiles of one chunk; null: empty.
  void add_chunk(std::span<const CompressedTile* const> tiles);
  void add(const SizeByThreshold& other);
  std::uint64_t bytes(int level) const { return bytes_[static_cast<std::size_t>(level)]; }

 private:
  std::size_t columns_;
  std::array<std::uint64_t, kLimitLevels> bytes_{};  // each chunk rounded up to its alignment
};

}  // namespace haarlight
