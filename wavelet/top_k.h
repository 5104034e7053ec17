// The k largest of many keys, with a total order so that ties never depend on luck.

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
};

}  // namespace haarlight
