// The largest of many keys, with a total order so that ties never depend on luck.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace haarlight {

/// Finds the k largest positive keys. Order: larger key first, equal keys by smaller index; a key
/// that is 0, negative or NaN is never chosen. Keeps its scratch, so no heap use once warm.
class TopK {
 public:
  /// Writes the chosen indices, ascending, into `chosen` (at most k; fewer when fewer keys are
  /// positive). O(keys.size()) on average.
  void select(std::span<const float> keys, int k, std::vector<int>& chosen);

 private:
  std::vector<std::uint64_t> packed_;
  std::vector<std::uint32_t> sample_;
};

/// The same order one by one, for when it is not known before how many are wanted. Sorts as far as
/// it is asked. Keeps its scratch, so no heap use once warm.
class RankedKeys {
 public:
  void start(std::span<const float> keys);
  /// Index of the next key, or -1 after the last positive one.
  int next();

 private:
  // Descending up to sorted_; those before large_ are larger than those behind it.
  std::vector<std::uint64_t> packed_;
  std::vector<std::uint32_t> sample_;
  std::size_t next_ = 0, sorted_ = 0, large_ = 0;
};

}  // namespace haarlight
