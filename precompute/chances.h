// Chooses one of many by weight.

#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace haarlight {

/// Chooses an index with chances in proportion to weights.
class Chances {
 public:
  void clear() { sum_.clear(); }
  void add(double weight) { sum_.push_back((sum_.empty() ? 0 : sum_.back()) + weight); }
  double total() const { return sum_.empty() ? 0 : sum_.back(); }
  double of(std::size_t i) const { return (sum_[i] - (i > 0 ? sum_[i - 1] : 0)) / total(); }
  /// By a number in [0, 1).
  std::size_t choose(double u) const {
    const auto at = std::upper_bound(sum_.begin(), sum_.end(), u * total());
    return std::min(static_cast<std::size_t>(at - sum_.begin()), sum_.size() - 1);
  }

 private:
  std::vector<double> sum_;
};

}  // namespace haarlight
