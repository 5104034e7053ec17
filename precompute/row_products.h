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

/// Sum of a[j] b[j] over `length`, a multiple of 8; in eight sums that are added in order, so the
/// same bits on every machine.
float dot_product(const float* a, const float* b, std::size_t length);

}  // namespace haarlight
