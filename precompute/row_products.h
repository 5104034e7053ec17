// The small matrix product that turns paths into rows.

#pragma once

#include <cstddef>
#include <vector>

namespace haarlight {

/// sum[m][j] += over k weight[k][m] * column[k][j], for m below `rows` and j below `length`.
/// `rows` is a multiple of 6, `length` of 8; `weight` is [count][rows], `sum` [rows][length].
/// The same bits on every machine: products are rounded before they are added.
void add_row_products(const float* weight, const std::vector<const float*>& column,
                      std::size_t rows, std::size_t length, float* sum);

}  // namespace haarlight
