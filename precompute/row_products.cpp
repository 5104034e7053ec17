// The small matrix products that turn paths into rows and pictures.

#include "precompute/row_products.h"

#include <bit>
#include <vector>

#include "core/simd.h"

namespace haarlight {
namespace {

typedef float Eight __attribute__((vector_size(32), aligned(4)));

// Sixteen entries of all columns that have some of them, packed, and the columns' weights.
struct Pack {
  std::vector<float> value;
  std::vector<const float*> weight;
};

// Six rows of sixteen entries stay in registers while k runs; the entries of all k are packed
// first, so that they are read from the nearest cache, and columns without any are left out.
HAARLIGHT_MULTIVERSION
void product(const float* weight, const SparseColumn* column, std::size_t count, std::size_t rows,
             std::size_t length, Pack& pack, float* sum, std::size_t stride) {
  for (std::size_t j = 0; j < length; j += 16) {
    const bool both = j + 8 < length;
    float* packed = pack.value.data();
    const float** of = pack.weight.data();
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint64_t on = column[k].packets >> (j / 8) & 3u;
      if (on == 0) continue;
      const float* from = column[k].value + j;
      *reinterpret_cast<Eight*>(packed) =
          (on & 1u) != 0 ? *reinterpret_cast<const Eight*>(from) : Eight{};
      *reinterpret_cast<Eight*>(packed + 8) =
          (on & 2u) != 0 ? *reinterpret_cast<const Eight*>(from + 8) : Eight{};
      packed += 16;
      *of++ = weight + k * rows;
    }
    const auto found = static_cast<std::size_t>(of - pack.weight.data());
    if (found == 0) continue;
    for (std::size_t m = 0; m < rows; m += 6) {
      Eight a0{}, a1{}, a2{}, a3{}, a4{}, a5{}, b0{}, b1{}, b2{}, b3{}, b4{}, b5{};
      const float* x = pack.value.data();
      for (std::size_t k = 0; k < found; ++k, x += 16) {
        const Eight p = *reinterpret_cast<const Eight*>(x);
        const Eight q = *reinterpret_cast<const Eight*>(x + 8);
        const float* w = pack.weight[k] + m;
        a0 += w[0] * p, b0 += w[0] * q;
        a1 += w[1] * p, b1 += w[1] * q;
        a2 += w[2] * p, b2 += w[2] * q;
        a3 += w[3] * p, b3 += w[3] * q;
        a4 += w[4] * p, b4 += w[4] * q;
        a5 += w[5] * p, b5 += w[5] * q;
      }
      const Eight a[6] = {a0, a1, a2, a3, a4, a5}, b[6] = {b0, b1, b2, b3, b4, b5};
      for (std::size_t r = 0; r < 6; ++r) {
        float* to = sum + (m + r) * stride + j;
        *reinterpret_cast<Eight*>(to) += a[r];
        if (both) *reinterpret_cast<Eight*>(to + 8) += b[r];
      }
    }
  }
}

// Four lights at a time, each in eight lanes.
HAARLIGHT_MULTIVERSION
void dots(const float* value, std::uint64_t packets, bool every, std::size_t count,
          const float* light, std::size_t lights, float* out) {
  for (std::size_t l = 0; l < lights; l += 4) {
    Eight a{}, b{}, c{}, d{};
    std::uint64_t left = packets;
    for (std::size_t i = 0; every ? i < count : left != 0; ++i) {
      const std::size_t p = every ? i : static_cast<std::size_t>(std::countr_zero(left));
      left &= left - 1;
      const Eight v = *reinterpret_cast<const Eight*>(value + 8 * p);
      const float* of = light + (p * lights + l) * 8;
      a += v * *reinterpret_cast<const Eight*>(of);
      b += v * *reinterpret_cast<const Eight*>(of + 8);
      c += v * *reinterpret_cast<const Eight*>(of + 16);
      d += v * *reinterpret_cast<const Eight*>(of + 24);
    }
    const Eight all[4] = {a, b, c, d};
    for (std::size_t i = 0; i < 4; ++i) {
      const Eight& s = all[i];
      out[l + i] += ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
    }
  }
}

HAARLIGHT_MULTIVERSION
void light_products(const PathLight* path, std::size_t count, std::size_t rows, std::size_t lights,
                    float* sum, std::size_t stride) {
  for (std::size_t m = 0; m < rows; m += 8) {
    for (std::size_t l = 0; l < lights; l += 4) {
      Eight a{}, b{}, c{}, d{};
      for (std::size_t k = 0; k < count; ++k) {
        const Eight w = *reinterpret_cast<const Eight*>(path[k].weight + m);
        const float* light = path[k].light + l;
        a += light[0] * w, b += light[1] * w, c += light[2] * w, d += light[3] * w;
      }
      const Eight all[4] = {a, b, c, d};
      for (std::size_t i = 0; i < 4; ++i) {
        *reinterpret_cast<Eight*>(sum + (l + i) * stride + m) += all[i];
      }
    }
  }
}

}  // namespace

HAARLIGHT_MULTIVERSION
void add_row_parts(std::span<const RowPart> parts, std::size_t size, bool keep, float* sum) {
  const RowPart a = parts[0], b = parts[parts.size() > 1 ? 1 : 0], c = parts[parts.size() - 1];
  const float second = parts.size() > 1 ? b.weight : 0, third = parts.size() > 2 ? c.weight : 0;
  for (std::size_t j = 0; j < size; j += 8) {
    Eight v = a.weight * *reinterpret_cast<const Eight*>(a.value + j);
    if (keep) v += *reinterpret_cast<const Eight*>(sum + j);
    if (second != 0) v += second * *reinterpret_cast<const Eight*>(b.value + j);
    if (third != 0) v += third * *reinterpret_cast<const Eight*>(c.value + j);
    *reinterpret_cast<Eight*>(sum + j) = v;
  }
}

HAARLIGHT_MULTIVERSION
void add_scaled(const SparseColumn& column, float scale, float* sum) {
  for (std::uint64_t left = column.packets; left != 0; left &= left - 1) {
    const auto at = 8 * static_cast<std::size_t>(std::countr_zero(left));
    *reinterpret_cast<Eight*>(sum + at) +=
        scale * *reinterpret_cast<const Eight*>(column.value + at);
  }
}

void add_row_products(const float* weight, std::span<const SparseColumn> column, std::size_t rows,
                      std::size_t length, float* sum, std::size_t stride) {
  if (column.empty()) return;
  thread_local Pack pack;
  pack.value.resize(16 * column.size());
  pack.weight.resize(column.size());
  product(weight, column.data(), column.size(), rows, length, pack, sum, stride);
}

void add_dot_products(const SparseColumn& column, const float* light, std::size_t lights,
                      float* out) {
  dots(column.value, column.packets, false, 0, light, lights, out);
}

void add_dot_products(const float* value, std::size_t packets, const float* light,
                      std::size_t lights, float* out) {
  dots(value, 0, true, packets, light, lights, out);
}

void add_light_products(std::span<const PathLight> paths, std::size_t rows, std::size_t lights,
                        float* sum, std::size_t stride) {
  light_products(paths.data(), paths.size(), rows, lights, sum, stride);
}

}  // namespace haarlight
