// Norms of columns over classes of rows: what a picture can change by, class by class.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/huge_page_vector.h"
#include "core/rgb.h"
#include "prt/transport.h"

namespace haarlight {

struct TermNorms {
  /// Of each stored row its class, below `count`, or kNoOutput, and what its squares weigh beside
  /// its colour. Reads all of T once. The same bits on any number of threads.
  TermNorms(const Transport& transport, std::span<const std::uint32_t> class_of_row,
            std::span<const float> weight_of_row, std::size_t count);

  /// sums[class][channel] = sum over coefficients of |x_jc| || T_jc || over the rows of the class,
  /// for x = target - shown and x = target; never too small. No heap use once warm.
  void bound(std::span<const Rgb> target, std::span<const Rgb> shown, std::vector<double>& change,
             std::vector<double>& light);

  std::size_t classes = 0;
  HugePageVector<float> norm;  ///< [coefficient][class][channel], never too small

 private:
  std::vector<std::vector<float>> slices_;  // [class][channel], of the change, then of the light
};

}  // namespace haarlight
