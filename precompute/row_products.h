// The small matrix products that turn paths into rows and pictures.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace haarlight {

/// Values in packets of eight, of which some are zero and need not be there.
struct SparseColumn {
  const float* value = nullptr;  ///< those of packets that are off are not read
  std::uint64_t packets = 0;     ///< bit p: entries [8 p, 8 p + 8) count
};

/// sum[m * stride + j] += over columns k of weight[k * rows + m] * column[k][j], for `rows` rows (a
/// multiple of 6) and j below `length` (a multiple of 8, at most 512).
void add_row_products(const float* weight, std::span<const SparseColumn> column, std::size_t rows,
                      std::size_t length, float* sum, std::size_t stride);

/// A row of `size` entries (a multiple of 8) times a weight.
struct RowPart {
  const float* value;
  float weight;
};
/// sum[j] = the sum of at most three parts, plus sum[j] if it is kept.
void add_row_parts(std::span<const RowPart> parts, std::size_t size, bool keep, float* sum);

/// sum[j] += scale * column[j].
void add_scaled(const SparseColumn& column, float scale, float* sum);

/// out[l] += the dot product of `column` with light l, for `lights` lights (a multiple of 4); light
/// is [packet][light][8].
void add_dot_products(const SparseColumn& column, const float* light, std::size_t lights,
                      float* out);
/// The same for `packets` packets of `value`, any number of them, none off.
void add_dot_products(const float* value, std::size_t packets, const float* light,
                      std::size_t lights, float* out);

/// What one path sends to all rows, and what it brings under each light.
struct PathLight {
  const float* weight;  ///< a number a row
  const float* light;   ///< a number a light
};
/// sum[l * stride + m] += over paths of weight[m] * light[l], for `rows` rows (a multiple of 8) and
/// `lights` lights (a multiple of 4).
void add_light_products(std::span<const PathLight> paths, std::size_t rows, std::size_t lights,
                        float* sum, std::size_t stride);

}  // namespace haarlight
