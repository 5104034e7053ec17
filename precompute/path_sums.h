// What the paths of a tile bring: columns of the sky, until they are rows and their noise is known.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/rgb.h"
#include "precompute/indirect_sky.h"
#include "precompute/row_products.h"
#include "precompute/tile_noise.h"
#include "prt/transport.h"

namespace haarlight {

/// Sums over the paths of one tile, and the memory for them; reused from tile to tile.
///
///   begin, add_direct for each row, then batches of paths, each ended by end_batch; at last
///   finish, and add_to for each row
///
/// A path serves one row with one weight, or all rows ("shared") with a weight each and a channel;
/// it brings columns, what a point sees of one phase of the sky, and deposits, single directions.
class PathSums {
 public:
  static constexpr std::size_t kRows = kTileRows;
  static constexpr std::size_t kOut = 3 * kRows;  ///< channel * kRows + row
  static constexpr std::int32_t kShared = -1;
  static constexpr int kParts = 4;  ///< of a batch; their spread is the noise

  /// Keeps a reference.
  void begin(const IndirectSky& sky);
  /// What row `out` (of kOut) shows directly, against which noise is measured.
  void add_direct(std::size_t out, const float* texels);

  /// A path of part `part` of the batch for one row, or a shared one with its weights, all zero.
  std::int32_t add_path(int part, std::size_t row, const RgbD& weight);
  std::int32_t add_shared_path(int part);
  bool is_shared(std::int32_t path) const { return paths_[at(path)].row == kShared; }
  /// kOut weights of a shared path, good until the next path is added.
  float* weights(std::int32_t path) { return bases_.data() + paths_[at(path)].base; }

  /// A column: `phase` of the sky seen by a path, times `tint`; bit p of `packets` says that slots
  /// [8 p, 8 p + 8) are seen and will be set. Returns its number.
  std::size_t add_column(std::int32_t path, int phase, const RgbD& tint, std::uint64_t packets);
  /// Values of a column, sky.slots(), good until the next is added.
  float* values(std::size_t column) { return values_.data() + column * slots_; }
  /// Counts what a column brings, once its values are there.
  void close_column(std::size_t column);
  /// Light of one texel, seen by a path.
  void add_deposit(std::int32_t path, std::size_t texel, const RgbD& tint);

  /// Ends a batch of `paths` starts, the last of `done` in all. Noise and energy of the tile's
  /// picture are those of all batches so far.
  void end_batch(int paths, int done, TileNoise& noise);
  /// Turns what is left into sums.
  void finish();
  /// texels[k] += scale times the sums of row `out`.
  void add_to(std::size_t out, float scale, float* texels) const;

 private:
  struct Path {
    std::int32_t row = kShared;
    int part = 0;
    RgbD own;              // weight of the row if not shared
    std::size_t base = 0;  // weights of all rows if shared: into bases_
  };
  struct Column {
    std::int32_t path = 0, phase = 0;
    RgbD tint;
    std::uint64_t packets = 0;
  };
  struct Deposit {
    std::int32_t path = 0;
    std::size_t texel = 0;
    RgbD tint;
  };

  static std::size_t at(std::int32_t path) { return static_cast<std::size_t>(path); }
  float* light(std::int32_t path) { return lights_.data() + at(path) * 3 * light_count_; }
  void judge(int paths, int done, TileNoise& noise);
  void apply();
  void apply_deposits();

  const IndirectSky* sky_ = nullptr;
  std::size_t slots_ = 0, light_count_ = 0;
  std::vector<Path> paths_;
  std::size_t first_of_batch_ = 0;  // paths
  std::vector<float> lights_;       // [path][channel][light]: what it brings
  std::vector<float> bases_;        // [shared path][kOut]
  std::vector<Column> columns_;
  std::vector<float> values_;  // [column][slot]
  std::vector<Deposit> deposits_;
  std::vector<float> sums_;                 // [kOut][phase][slot]
  std::vector<std::uint32_t> deposit_at_;   // of a texel: one more than its place, or 0: none yet
  std::vector<std::size_t> deposit_texel_;  // of a place
  std::vector<float> deposited_;            // [place][kOut]
  // Of judging, [light][kOut].
  std::vector<float> direct_, part_sum_;
  std::vector<double> sum_, square_;
  // Of one product.
  std::vector<float> weights_;
  std::vector<SparseColumn> sparse_;
  std::vector<std::vector<std::size_t>> of_phase_;
  std::vector<PathLight> path_lights_;
};

}  // namespace haarlight
