// One pass over the transport: columns to sketches, norms and sums.

#include "prt/error_tables.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/parallel.h"
#include "core/simd.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
constexpr std::size_t kBlock = 3 * kRows;  // [channel][row of block]
constexpr int kColumnsOfTask = 64;
constexpr std::size_t kPictureGroups = 64, kMeshGroups = 128, kMeshSketches = 32, kMeshLanes = 4;

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

// What the rows have in common for all columns, [block][channel][row of block].
struct RowFactors {
  HugePageVector<float> factor, norm_factor;  // weight times colour
  HugePageVector<float> sign;
};

// Sums over blocks of one group, and of one column.
struct GroupSums {
  float sketch[kBlock], square[kBlock], sum[kBlock];
};

// Adds a stored block; `values` of channel ch begin at ch * value_stride, as scales do.
HAARLIGHT_MULTIVERSION void add_block(const std::int8_t* values, std::size_t value_stride,
                                      const float* scales, const float* factor,
                                      const float* norm_factor, const float* sign, GroupSums& out) {
  for (std::size_t ch = 0; ch < 3; ++ch) {
    const std::int8_t* q = values + ch * value_stride;
    for (std::size_t r = 0; r < kRows; ++r) {
      const std::size_t k = ch * kRows + r;
      const float t = static_cast<float>(q[r]) * scales[ch];
      const float weighted = t * factor[k], for_norm = t * norm_factor[k];
      out.sketch[k] += sign[k] * weighted;
      out.square[k] += for_norm * for_norm;
      out.sum[k] += weighted;
    }
  }
}

// Adds a column's blocks of a chunk, whose first block is `first`; done(group, sums) gets the sums
// of every group that has any.
template <typename Done>
void add_column(const std::uint64_t* rgb_blocks, const ColumnBlocks& blocks, std::size_t first,
                const RowFactors& rows, const std::vector<std::uint8_t>& group_of_block,
                const Done& done) {
  GroupSums part{};
  std::size_t group = ~std::size_t{0};
  for_stored_blocks(
      blocks, rgb_blocks,
      [&](std::size_t b, bool rgb, const std::uint16_t* scale, const std::int8_t* value) {
        const std::size_t block = first + b, at = block * kBlock;
        if (group_of_block[block] != group) {
          if (group != ~std::size_t{0}) done(group, part);
          part = {};
          group = group_of_block[block];
        }
        float scales[3];
        for (std::size_t ch = 0; ch < 3; ++ch) scales[ch] = scale_from_bits(scale[rgb ? ch : 0]);
        add_block(value, rgb ? kRows : 0, scales, rows.factor.data() + at,
                  rows.norm_factor.data() + at, rows.sign.data() + at, part);
      });
  if (group != ~std::size_t{0}) done(group, part);
}

}  // namespace

std::vector<float> relative_vertex_areas(const TransportMesh& mesh) {
  std::vector<double> area(mesh.position.size());
  for (const auto& corner : mesh.triangle) {
    const Vec3 a = mesh.world(corner[0]), b = mesh.world(corner[1]), c = mesh.world(corner[2]);
    const Vec3 n = cross(b - a, c - a);
    const double third = std::sqrt(dot(n, n)) / 6;
    for (const std::uint32_t v : corner) area[v] += third;
  }
  double mean = 0;
  for (const double a : area) mean += a / static_cast<double>(area.size());
  std::vector<float> relative(area.size(), 1.0f);
  if (!(mean > 0)) return relative;
  for (std::size_t v = 0; v < area.size(); ++v) relative[v] = static_cast<float>(area[v] / mean);
  return relative;
}

ErrorTables::ErrorTables(const Transport& transport) {
  const auto columns = static_cast<std::size_t>(transport.layout().size());
  const auto rows = static_cast<std::size_t>(transport.rows());
  const std::size_t blocks = rows / kRows;
  const bool mesh = transport.kind() == TransportKind::mesh;
  lanes = mesh ? kMeshLanes : kRows;
  groups = std::clamp<std::size_t>(blocks, 1, mesh ? kMeshGroups : kPictureGroups);
  sketch_groups = mesh ? std::min(groups, kMeshSketches) : 1;

  // Areas, colours and signs of rows. Groups share out the blocks that have a meaning.
  std::vector<float> of_output;
  if (mesh) of_output = relative_vertex_areas(*transport.info().mesh);
  const std::span<const std::uint32_t> output = transport.row_output();
  std::size_t last = rows;
  while (last > 1 && output[last - 1] == kNoOutput) --last;
  const std::size_t used = (last + kRows - 1) / kRows;
  group_of_block_.resize(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    group_of_block_[b] = static_cast<std::uint8_t>(std::min(b * groups / used, groups - 1));
  }
  area.assign(rows, 0.0f);
  group_rows.assign(groups, 0);
  RowFactors all;
  for (auto* factor : {&all.factor, &all.norm_factor, &all.sign}) factor->resize(3 * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    if (output[row] == kNoOutput) continue;
    area[row] = mesh ? of_output[output[row]] : 1.0f;
    ++group_rows[group_of_row(row)];
    const Rgb color = transport.row_color()[row];
    const float channel[3] = {color.r, color.g, color.b};
    const float weight = std::sqrt(area[row]);
    const float norm_weight = mesh ? std::sqrt(area[row] + 1) : 1.0f;
    for (std::size_t ch = 0; ch < 3; ++ch) {
      const std::size_t k = row / kRows * kBlock + ch * kRows + row % kRows;
      all.factor[k] = weight * channel[ch];
      all.norm_factor[k] = norm_weight * channel[ch];
      all.sign[k] = sign_of(row, ch);
    }
  }

  sketch.resize(columns * sketch_size());
  norm.resize(columns * groups * 3);
  if (!mesh) sum.resize(columns * groups * 3);
  const int tasks = (static_cast<int>(columns) + kColumnsOfTask - 1) / kColumnsOfTask;
  parallel_for(tasks, [&](int task) {
    const int begin = task * kColumnsOfTask;
    const int end = std::min(begin + kColumnsOfTask, static_cast<int>(columns));
    const auto count = static_cast<std::size_t>(end - begin);
    std::vector<double> sketches(count * sketch_size());
    std::vector<double> squares(count * groups * 3), sums(count * groups * 3);
    for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
      const std::size_t first = static_cast<std::size_t>(chunk) * kChunkBlocks;
      for (int j = begin; j < end; ++j) {
        const ColumnBlocks stored = transport.column(chunk, j);
        if (!stored.present) continue;
        const auto column = static_cast<std::size_t>(j - begin);
        add_column(transport.rgb_blocks(chunk), stored, first, all, group_of_block_,
                   [&](std::size_t group, const GroupSums& part) {
                     double* to = sketches.data() + column * sketch_size() +
                                  sketch_of_group(group) * 3 * lanes;
                     const std::size_t at = column * 3 * groups + group;
                     for (std::size_t k = 0; k < kBlock; ++k) {
                       const std::size_t ch = k / kRows;
                       to[ch * lanes + k % lanes] += static_cast<double>(part.sketch[k]);
                       squares[at + ch * groups] += static_cast<double>(part.square[k]);
                       sums[at + ch * groups] += static_cast<double>(part.sum[k]);
                     }
                   });
      }
    }
    const auto place = static_cast<std::size_t>(begin);
    for (std::size_t i = 0; i < sketches.size(); ++i) {
      sketch[place * sketch_size() + i] = static_cast<float>(sketches[i]);
    }
    for (std::size_t i = 0; i < squares.size(); ++i) {
      norm[place * groups * 3 + i] = static_cast<float>(std::sqrt(squares[i]) * kNormRounding);
      if (!mesh) sum[place * groups * 3 + i] = static_cast<float>(sums[i]);
    }
  });
}

}  // namespace haarlight
