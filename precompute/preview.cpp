// Stand-ins for tiles that were not traced.

#include "precompute/preview.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>

#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);
constexpr std::size_t kNone = kRows;
// Near the middle: of a block of 4x4 pixels, and of a tile of four.
constexpr std::size_t kMiddleOfBlock = 5, kMiddleOfTile = 15;

// The row to trace of rows [begin, begin + count): `wanted`, or the first with a meaning.
std::size_t choose_row(std::span<const std::uint32_t> outputs, std::size_t begin, std::size_t count,
                       std::size_t wanted) {
  if (outputs[begin + wanted] != kNoOutput) return begin + wanted;
  for (std::size_t r = begin; r < begin + count; ++r) {
    if (outputs[r] != kNoOutput) return r;
  }
  return kNone;
}

// Row `from` of a traced tile to rows [begin, begin + count).
void copy_row(TileRows& rows, std::size_t from, std::size_t begin, std::size_t count,
              bool from_rgb) {
  const std::size_t channels = rows.rgb_blocks == 0 ? 1 : 3;
  const std::size_t size = rows.values.size() / (channels * kRows);
  for (std::size_t r = begin; r < begin + count; ++r) {
    if (r == from) continue;
    rows.color[r] = rows.color[from];
    rows.coverage[r] = rows.coverage[from];
    for (std::size_t ch = 0; ch < (from_rgb ? channels : 1); ++ch) {
      std::copy_n(rows.values.begin() + static_cast<std::ptrdiff_t>((ch * kRows + from) * size),
                  size, rows.values.begin() + static_cast<std::ptrdiff_t>((ch * kRows + r) * size));
    }
  }
}

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

void trace_preview(TileSource::Worker& worker, std::span<const std::uint32_t> outputs, bool blocks,
                   TileRows& rows) {
  std::array<std::uint32_t, kRows> wanted;
  wanted.fill(kNoOutput);
  std::array<std::size_t, kTileBlocks> chosen{};
  const std::size_t middle = choose_row(outputs, 0, kRows, kMiddleOfTile);
  for (std::size_t b = 0; b < kTileBlocks; ++b) {
    chosen[b] = blocks ? choose_row(outputs, b * kBlock, kBlock, kMiddleOfBlock) : middle;
    if (chosen[b] != kNone) wanted[chosen[b]] = outputs[chosen[b]];
  }
  worker.trace(wanted, rows);
  rows.noise_variance.clear();  // a few rows say nothing of the rest
  rows.noise_energy.clear();
  const unsigned traced_rgb = rows.rgb_blocks;
  if (!blocks) {
    const bool rgb = middle != kNone && (traced_rgb >> (middle / kBlock) & 1) != 0;
    rows.rgb_blocks = rgb ? 15u : 0u;
    if (middle != kNone) copy_row(rows, middle, 0, kRows, rgb);
    return;
  }
  for (std::size_t b = 0; b < kTileBlocks; ++b) {
    if (chosen[b] != kNone) {
      copy_row(rows, chosen[b], b * kBlock, kBlock, (traced_rgb >> b & 1) != 0);
    }
  }
}

PreviewGrain choose_grain(TileSource::Worker& worker, const HaarLayout& layout,
                          std::span<const float> thresholds, std::span<const std::uint32_t> order,
                          std::span<const int> missing, double seconds, int workers,
                          double& estimate) {
  estimate = 0;
  if (missing.empty()) return {};
  // The dearest of a few, with what comes after the rays.
  TileRows rows;
  const auto dearest = [&](bool blocks) {
    double most = 0;
    for (const std::size_t part : {1u, 3u, 5u}) {
      const auto tile = static_cast<std::size_t>(missing[missing.size() * part / 6]);
      most = std::max(most, seconds_of([&] {
                        trace_preview(worker, order.subspan(tile * kRows, kRows), blocks, rows);
                        compress_tile(layout, rows, thresholds);
                      }));
    }
    return most;
  };
  const double tiles = static_cast<double>(missing.size()) / std::max(1, workers);
  PreviewGrain grain;
  grain.tiles = kMaxPreviewTiles;
  grain.blocks = false;
  const double one = dearest(false);
  for (int n = 1; n <= kMaxPreviewTiles; n *= 4) {
    grain.tiles = n;
    estimate = one * tiles / n;
    if (estimate <= seconds) break;
  }
  if (grain.tiles == 1 && estimate * 2 <= seconds) {
    const double fine = dearest(true) * tiles;
    if (fine <= seconds) {
      grain.blocks = true;
      estimate = fine;
    }
  }
  return grain;
}

Preview::Preview(const TileSource& source, std::vector<std::uint32_t> order, PreviewGrain grain,
                 std::vector<float> thresholds)
    : source_(source), order_(std::move(order)), grain_(grain), thresholds_(std::move(thresholds)) {
  std::size_t rows = order_.size();
  while (rows > 1 && order_[rows - 1] == kNoOutput) --rows;
  last_tile_ = static_cast<int>((rows - 1) / kRows);
}

std::shared_ptr<const TileRecord> Preview::record(int tile) {
  if (grain_.blocks || grain_.tiles == 1) return make(tile);
  // One in the middle of the group stands for all; tiles lie along a space-filling curve. Groups
  // are asked for in order, chunk by chunk, so that few need to be kept.
  const int first = tile / grain_.tiles * grain_.tiles;
  {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(first);
    if (found != known_.end()) return found->second;
  }
  std::shared_ptr<const TileRecord> made = make(std::min(first + grain_.tiles / 2, last_tile_));
  const std::lock_guard lock(mutex_);
  constexpr std::size_t kMostKept = 64;
  if (known_.size() >= kMostKept) known_.erase(known_.begin());
  known_.emplace(first, made);
  return made;
}

std::shared_ptr<const TileRecord> Preview::make(int tile) {
  std::unique_ptr<Work> work;
  {
    const std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      work = std::move(free_.back());
      free_.pop_back();
    }
  }
  if (!work) work = std::make_unique<Work>(Work{source_.make_worker(), {}});
  const auto outputs =
      std::span<const std::uint32_t>(order_).subspan(static_cast<std::size_t>(tile) * kRows, kRows);
  trace_preview(*work->worker, outputs, grain_.blocks, work->rows);
  auto record = std::make_shared<TileRecord>();
  record->tile = compress_tile(source_.layout(), work->rows, thresholds_);
  record->color = work->rows.color;
  record->coverage = work->rows.coverage;
  const std::lock_guard lock(mutex_);
  free_.push_back(std::move(work));
  return record;
}

}  // namespace haarlight
