// The small matrix product that turns paths into rows.

#include "precompute/row_products.h"

#include "core/simd.h"

namespace haarlight {
namespace {

typedef float Eight __attribute__((vector_size(32), aligned(4)));

// Six rows of eight columns stay in registers while k runs; the eight columns of all k are packed
// first, so that they are read from the nearest cache.
HAARLIGHT_MULTIVERSION
void product(const float* weight, const float* const* column, std::size_t count, std::size_t rows,
             std::size_t length, float* packed, float* sum) {
  for (std::size_t j = 0; j < length; j += 8) {
    for (std::size_t k = 0; k < count; ++k) {
      *reinterpret_cast<Eight*>(packed + 8 * k) = *reinterpret_cast<const Eight*>(column[k] + j);
    }
    for (std::size_t m = 0; m < rows; m += 6) {
      Eight a0{}, a1{}, a2{}, a3{}, a4{}, a5{};
      const float* w = weight + m;
      for (std::size_t k = 0; k < count; ++k, w += rows) {
        const Eight x = *reinterpret_cast<const Eight*>(packed + 8 * k);
        a0 += w[0] * x, a1 += w[1] * x, a2 += w[2] * x;
        a3 += w[3] * x, a4 += w[4] * x, a5 += w[5] * x;
      }
      const Eight all[6] = {a0, a1, a2, a3, a4, a5};
      for (std::size_t r = 0; r < 6; ++r) {
        *reinterpret_cast<Eight*>(sum + (m + r) * length + j) += all[r];
      }
    }
  }
}

}  // namespace

HAARLIGHT_MULTIVERSION
float dot_product(const float* a, const float* b, std::size_t length) {
  Eight sum{};
  for (std::size_t j = 0; j < length; j += 8) {
    sum += *reinterpret_cast<const Eight*>(a + j) * *reinterpret_cast<const Eight*>(b + j);
  }
  float total = 0;
  for (std::size_t i = 0; i < 8; ++i) total += sum[i];
  return total;
}

void add_row_products(const float* weight, const std::vector<const float*>& column,
                      std::size_t rows, std::size_t length, float* sum) {
  if (column.empty()) return;
  thread_local std::vector<float> packed;
  packed.resize(8 * column.size());
  product(weight, column.data(), column.size(), rows, length, packed.data(), sum);
}

}  // namespace haarlight
