// A few rows of T, or sums of rows, times any lighting: the light that they leave out, exactly.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/huge_page_vector.h"
#include "core/rgb.h"
#include "prt/transport.h"

namespace haarlight {

/// color * sum over i of weight[i] * row (first_row + i), rows as stored.
struct RowSum {
  std::uint32_t first_row = 0;
  std::vector<float> weight;
  Rgb color{1, 1, 1};
};

/// Only entries that are not zero are kept: 6 bytes each, column by column.
class SampleRows {
 public:
  /// Reads all of T once. Requires rows in range. The same on any number of threads.
  SampleRows(const Transport& transport, std::vector<RowSum> sums);

  /// change = sums * (target - shown), light = sums * target; one entry a sum. Lightings are
  /// layout.size() coefficients. In float, 2^-24 of what the largest partial sum is. No heap use
  /// once warm; the same bits on any number of threads.
  void multiply(std::span<const Rgb> target, std::span<const Rgb> shown, std::vector<RgbD>& change,
                std::vector<RgbD>& light);
  /// change -= sums * column `index` * difference.
  void take_away(int index, const Rgb& difference, std::vector<RgbD>& change) const;
  /// change += sums * rows, given by [row][channel].
  void add_rows(std::span<const double> rows, std::vector<RgbD>& change) const;

  std::size_t size() const { return sums_.size(); }
  std::uint64_t bytes() const;

 private:
  struct Line {
    std::uint32_t sum = 0;
    int channel = -1;  // -1: of all three
  };
  struct Slice {  // of columns
    std::vector<std::uint32_t> first;
    HugePageVector<std::uint16_t> line;
    HugePageVector<float> value;
    std::vector<float> change, light;  // [line][4]
  };
  void read_slice(const Transport& transport, int slice, Slice& out) const;

  std::vector<RowSum> sums_;
  std::vector<Line> lines_;
  std::vector<std::uint32_t> first_line_;     // of each sum
  std::vector<std::int32_t> place_of_block_;  // among those that are read, or -1
  std::size_t places_ = 0;
  std::vector<Slice> slices_;
  std::vector<double> sum_;  // [line][change or light][channel]
};

inline constexpr std::size_t kMostSampleLines = 65536;

}  // namespace haarlight
