// Selection by packed keys: float bits of a positive number order as integers.

#include "wavelet/top_k.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <functional>

namespace haarlight {

void TopK::select(std::span<const float> keys, int k, std::vector<int>& chosen) {
  chosen.clear();
  if (k <= 0) return;
  // Key in the upper half, inverted index in the lower: one integer comparison is the total order.
  packed_.resize(keys.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!(keys[i] > 0.0f)) continue;  // also drops NaN
    packed_[count++] = (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(keys[i])) << 32) |
                       (0xffffffffu - static_cast<std::uint32_t>(i));
  }
  const auto begin = packed_.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  auto last = end;
  if (static_cast<std::size_t>(k) < count) {
    last = begin + k;
    std::nth_element(begin, last, end, std::greater<>());
  }
  for (auto it = begin; it != last; ++it) {
    chosen.push_back(static_cast<int>(0xffffffffu - static_cast<std::uint32_t>(*it)));
  }
  std::sort(chosen.begin(), chosen.end());
}

}  // namespace haarlight
