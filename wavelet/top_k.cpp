// Selection by packed keys: float bits of a positive number order as integers.

#include "wavelet/top_k.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>

namespace haarlight {
namespace {

constexpr std::size_t kFirstRanks = 256;  // sorted at once, doubling after

constexpr std::size_t kSampled = 16;  // one key of so many says where the large ones begin

std::uint64_t packed(float key, std::size_t index) {
  return (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(key)) << 32) |
         (0xffffffffu - static_cast<std::uint32_t>(index));
}

// A key that about `wanted` keys, likely not fewer, are not below; none if that may be all of them.
std::optional<float> large_key(std::span<const float> keys, std::size_t wanted,
                               std::vector<std::uint32_t>& sample) {
  sample.resize(keys.size() / kSampled + 1);
  std::size_t count = 0;
  for (std::size_t i = 0; i < keys.size(); i += kSampled) {
    if (keys[i] > 0.0f) sample[count++] = std::bit_cast<std::uint32_t>(keys[i]);
  }
  // Half as many again, and four: three deviations of a sample of thirty.
  const std::size_t rank = wanted / kSampled * 3 / 2 + 4;
  if (rank >= count) return std::nullopt;
  const auto at = sample.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(sample.begin(), at, sample.begin() + static_cast<std::ptrdiff_t>(count),
                   std::greater<>());
  return std::bit_cast<float>(*at);
}

// Keys that are wanted, packed: key in the upper half, inverted index in the lower, so that one
// integer comparison is the total order. Returns how many.
template <typename Wanted>
std::size_t pack(std::span<const float> keys, std::vector<std::uint64_t>& out,
                 const Wanted& wanted) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (wanted(keys[i])) out[count++] = packed(keys[i], i);
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
  packed_.resize(keys.size());
  std::size_t count = 0;
  if (const auto least = large_key(keys, static_cast<std::size_t>(k), sample_)) {
    // Few are, so that the branch is foreseen.
    count = pack(keys, packed_, [&](float key) { return key >= *least; });
  }
  if (count < static_cast<std::size_t>(k)) {
    count = pack(keys, packed_, [](float key) { return key > 0.0f; });
  }
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
  // One pass: large keys from the front, other positive ones from the back.
  packed_.resize(keys.size());
  const float least = large_key(keys, kFirstRanks, sample_).value_or(0.0f);
  std::size_t front = 0, back = keys.size();
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!(keys[i] > 0.0f)) continue;  // also drops NaN
    const bool large = keys[i] >= least;
    back -= large ? 0 : 1;
    packed_[large ? front : back] = packed(keys[i], i);
    front += large ? 1 : 0;
  }
  packed_.erase(packed_.begin() + static_cast<std::ptrdiff_t>(front),
                packed_.begin() + static_cast<std::ptrdiff_t>(back));
  large_ = front;
  next_ = sorted_ = 0;
}

int RankedKeys::next() {
  if (next_ == packed_.size()) return -1;
  if (next_ == sorted_) {
    const auto at = [&](std::size_t i) { return packed_.begin() + static_cast<std::ptrdiff_t>(i); };
    const std::size_t among = sorted_ < large_ ? large_ : packed_.size();
    const std::size_t end = std::min(among, std::max(kFirstRanks, 2 * sorted_));
    if (end < among) std::nth_element(at(sorted_), at(end), at(among), std::greater<>());
    std::sort(at(sorted_), at(end), std::greater<>());
    sorted_ = end;
  }
  return index_of(packed_[next_++]);
}

}  // namespace haarlight
