// Selection by packed keys: float bits of a positive number order as integers.

#include "wavelet/top_k.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <functional>

namespace haarlight {
namespace {

constexpr std::size_t kFirstRanks = 256;  // sorted at once, doubling after

// Positive keys, packed: key in the upper half, inverted index in the lower, so that one integer
// comparison is the total order. Returns how many.
std::size_t pack(std::span<const float> keys, std::vector<std::uint64_t>& packed) {
  packed.resize(keys.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!(keys[i] > 0.0f)) continue;  // also drops NaN
    packed[count++] = (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(keys[i])) << 32) |
                      (0xffffffffu - static_cast<std::uint32_t>(i));
  }
  return count;
}

int index_of(std::uint64_t packed) {
  return static_cast<int>(0xffffffffu - static_cast<std::uint32_t>(packed));
}

}  // namespace

void TopK::select(std::span<const float> keys, int k, std::vector<int>& chosen) {
  chosen.clear();
  if (k <= 0) return;
  const std::size_t count = pack(keys, packed_);
  const auto begin = packed_.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  auto last = end;
  if (static_cast<std::size_t>(k) < count) {
    last = begin + k;
    std::nth_element(begin, last, end, std::greater<>());
  }
  for (auto it = begin; it != last; ++it) {
    chosen.push_back(index_of(*it));
  }
  std::sort(chosen.begin(), chosen.end());
}

void RankedKeys::start(std::span<const float> keys) {
  packed_.resize(pack(keys, packed_));
  next_ = sorted_ = 0;
}

int RankedKeys::next() {
  if (next_ == packed_.size()) return -1;
  if (next_ == sorted_) {
    const auto at = [&](std::size_t i) { return packed_.begin() + static_cast<std::ptrdiff_t>(i); };
    const std::size_t end = std::min(packed_.size(), std::max(kFirstRanks, 2 * sorted_));
    if (end < packed_.size())
      std::nth_element(at(sorted_), at(end), packed_.end(), std::greater<>());
    std::sort(at(sorted_), at(end), std::greater<>());
    sorted_ = end;
  }
  return index_of(packed_[next_++]);
}

}  // namespace haarlight
