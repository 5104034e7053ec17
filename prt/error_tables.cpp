// One pass over the transport: columns to sketches, norms and sums.

#include "prt/error_tables.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"
#include "core/simd.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr std::size_t kLanes = ErrorTables::kLanes;
constexpr std::size_t kSketch = ErrorTables::kSketch;
constexpr int kColumnsOfTask = 64;
constexpr std::size_t kMostNormGroups = 8, kMostSketchGroups = 4;

// Norms are sums of floats: at most 256 blocks of squares in a lane, each square rounded three
// times, are within 260 x 2^-24 < 2e-5 of the truth.
constexpr double kNormRounding = 1 + 2e-5;

// +1 or -1 from integers alone (splitmix64's finaliser).
float sign_of(std::uint64_t row, std::uint64_t channel) {
  std::uint64_t x = (3 * row + channel + 1) * 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return (x ^ (x >> 31)) >> 63 ? 1.0f : -1.0f;
}

// What the rows of a chunk have in common with all columns, [block][channel][row of block].
struct RowFactors {
  HugePageVector<float> factor;  // weight times colour
  HugePageVector<float> sign;
};

struct ColumnSums {
  float sketch[kSketch], square[kSketch], sum[kSketch];
};

// Adds a stored block; `values` of channel ch begin at ch * value_stride, as scales do.
HAARLIGHT_MULTIVERSION void add_block(const std::int8_t* values, std::size_t value_stride,
                                      const float* scales, const float* factor, const float* sign,
                                      ColumnSums& out) {
  for (std::size_t ch = 0; ch < 3; ++ch) {
    const std::int8_t* q = values + ch * value_stride;
    for (std::size_t r = 0; r < kLanes; ++r) {
      const std::size_t k = ch * kLanes + r;
      const float t = static_cast<float>(q[r]) * scales[ch] * factor[k];
      out.sketch[k] += sign[k] * t;
      out.square[k] += t * t;
      out.sum[k] += t;
    }
  }
}

void add_column(const std::uint64_t* rgb_blocks, const ColumnBlocks& blocks, const float* factor,
                const float* sign, ColumnSums& out) {
  const std::uint16_t* scale = blocks.scales;
  const std::int8_t* value = blocks.values;
  for (std::size_t word = 0; word < 4; ++word) {
    for (std::uint64_t bits = blocks.present[word]; bits; bits &= bits - 1) {
      const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
      const std::size_t at = (64 * word + bit) * kSketch;
      const bool rgb = rgb_blocks[word] >> bit & 1;
      float scales[3];
      for (std::size_t ch = 0; ch < 3; ++ch) scales[ch] = scale_from_bits(scale[rgb ? ch : 0]);
      add_block(value, rgb ? kLanes : 0, scales, factor + at, sign + at, out);
      scale += rgb ? 3 : 1;
      value += rgb ? 3 * kLanes : kLanes;
    }
  }
}

// Root of the area of surface around each vertex, a third of each triangle, over their mean.
std::vector<float> vertex_weights(const TransportMesh& mesh) {
  std::vector<double> area(mesh.position.size());
  for (const auto& corner : mesh.triangle) {
    const Vec3 a = mesh.world(corner[0]), b = mesh.world(corner[1]), c = mesh.world(corner[2]);
    const Vec3 n = cross(b - a, c - a);
    const double third = std::sqrt(dot(n, n)) / 6;
    for (const std::uint32_t v : corner) area[v] += third;
  }
  double mean = 0;
  for (const double a : area) mean += a / static_cast<double>(area.size());
  std::vector<float> weight(area.size(), 1.0f);
  if (!(mean > 0)) return weight;
  for (std::size_t v = 0; v < area.size(); ++v) {
    weight[v] = static_cast<float>(std::sqrt(area[v] / mean));
  }
  return weight;
}

}  // namespace

ErrorTables::ErrorTables(const Transport& transport) {
  const auto columns = static_cast<std::size_t>(transport.layout().size());
  const auto rows = static_cast<std::size_t>(transport.rows());
  const bool mesh = transport.kind() == TransportKind::mesh;
  chunks_ = static_cast<std::size_t>(transport.chunk_count());
  norm_groups = std::clamp<std::size_t>(chunks_, 1, kMostNormGroups);
  sketch_groups = mesh ? std::clamp<std::size_t>(chunks_, 1, kMostSketchGroups) : 1;

  // Weights, colours and signs of rows.
  std::vector<float> of_output;
  if (mesh) of_output = vertex_weights(*transport.info().mesh);
  row_weight.assign(rows, 0.0f);
  group_weight.assign(norm_groups, 0.0);
  group_rows.assign(norm_groups, 0);
  RowFactors all;
  all.factor.resize(3 * rows);
  all.sign.resize(3 * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::uint32_t output = transport.row_output()[row];
    if (output == kNoOutput) continue;
    const float weight = mesh ? of_output[output] : 1.0f;
    const std::size_t g = norm_group(static_cast<int>(row / kChunkRows));
    row_weight[row] = weight;
    group_weight[g] += static_cast<double>(weight) * static_cast<double>(weight);
    ++group_rows[g];
    const Rgb color = weight * transport.row_color()[row];
    const float channel[3] = {color.r, color.g, color.b};
    for (std::size_t ch = 0; ch < 3; ++ch) {
      const std::size_t k = row / kLanes * kSketch + ch * kLanes + row % kLanes;
      all.factor[k] = channel[ch];
      all.sign[k] = sign_of(row, ch);
    }
  }

  sketch.resize(columns * sketch_groups * kSketch);
  norm.resize(columns * norm_groups * 3);
  sum.resize(columns * norm_groups * 3);
  const int tasks = (static_cast<int>(columns) + kColumnsOfTask - 1) / kColumnsOfTask;
  parallel_for(tasks, [&](int task) {
    const int begin = task * kColumnsOfTask;
    const int end = std::min(begin + kColumnsOfTask, static_cast<int>(columns));
    const auto count = static_cast<std::size_t>(end - begin);
    std::vector<double> sketches(count * sketch_groups * kSketch);
    std::vector<double> squares(count * norm_groups * 3), sums(count * norm_groups * 3);
    for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
      const std::size_t first = static_cast<std::size_t>(chunk) * kChunkRows * 3;
      for (int j = begin; j < end; ++j) {
        const ColumnBlocks blocks = transport.column(chunk, j);
        if (!blocks.present) continue;
        ColumnSums part{};
        add_column(transport.rgb_blocks(chunk), blocks, all.factor.data() + first,
                   all.sign.data() + first, part);
        const auto k = static_cast<std::size_t>(j - begin);
        double* to = sketches.data() + (k * sketch_groups + sketch_group(chunk)) * kSketch;
        for (std::size_t i = 0; i < kSketch; ++i) to[i] += static_cast<double>(part.sketch[i]);
        const std::size_t at = (k * norm_groups + norm_group(chunk)) * 3;
        for (std::size_t i = 0; i < kSketch; ++i) {
          squares[at + i / kLanes] += static_cast<double>(part.square[i]);
          sums[at + i / kLanes] += static_cast<double>(part.sum[i]);
        }
      }
    }
    const auto place = static_cast<std::size_t>(begin);
    for (std::size_t i = 0; i < sketches.size(); ++i) {
      sketch[place * sketch_groups * kSketch + i] = static_cast<float>(sketches[i]);
    }
    for (std::size_t i = 0; i < squares.size(); ++i) {
      norm[place * norm_groups * 3 + i] = static_cast<float>(std::sqrt(squares[i]) * kNormRounding);
      sum[place * norm_groups * 3 + i] = static_cast<float>(sums[i]);
    }
  });
}

}  // namespace haarlight
