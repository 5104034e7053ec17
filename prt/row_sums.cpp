// Running sums and the log of each band; see row_sums.h for the idea.

#include "prt/row_sums.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/huge_page_vector.h"
#include "core/parallel.h"
#include "prt/apply_kernel.h"

namespace haarlight {
namespace {

// A band's log is folded into a kept picture when streaming it would cost this many pictures of
// sums, its oldest columns first, about one picture's worth in a frame: so much more than a read
// and a write of the picture that no time is lost by folding in parts, and no frame waits long.
constexpr std::uint64_t kFoldPictures = 4;
constexpr std::uint64_t kShortPictures = 1;

// Above so many columns a chunk's runs are next to each other or past what caches hold.
constexpr std::size_t kPrefetchColumns = 512;

// Blocks of a chunk that at least one of the columns has: those whose sums are read and written.
std::uint64_t touched_blocks(const std::vector<ColumnTask>& tasks) {
  std::uint64_t any[4] = {};
  for (const ColumnTask& task : tasks) {
    for (int w = 0; w < 4; ++w) any[w] |= task.blocks.present[w];
  }
  std::uint64_t count = 0;
  for (const std::uint64_t word : any) count += static_cast<std::uint64_t>(std::popcount(word));
  return count;
}

void prefetch(const ColumnBlocks& blocks) {
  const auto* bytes = reinterpret_cast<const char*>(blocks.present);
  for (std::uint32_t at = 0; at < blocks.bytes; at += 64) __builtin_prefetch(bytes + at, 0, 2);
}

}  // namespace

struct RowSums::State {
  explicit State(Transport t) : transport(std::move(t)) {
    const auto chunks = static_cast<std::size_t>(transport.chunk_count());
    const auto columns = static_cast<std::size_t>(transport.layout().size());
    totals.resize(chunks * kChunkTotals);
    chunk_lit.assign(chunks, 0);
    chunk_untold.assign(chunks, 0);
    shown.resize(columns);
    in_shown.assign(columns, 0);
    logged.resize(columns);
    in_log.assign(columns, 0);
    bytes_of.resize(columns);
    runs_of.resize(columns);
    for (std::size_t j = 0; j < columns; ++j) {
      const int index = static_cast<int>(j);
      bytes_of[j] = transport.column_bytes(index);
      for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
        runs_of[j] += transport.column(chunk, index).present != nullptr;
      }
    }
    columns_scratch.reserve(columns);
  }

  std::uint64_t picture_bytes() const { return totals.size() * sizeof(double); }

  Transport transport;
  HugePageVector<double> totals;
  std::vector<std::uint8_t> chunk_lit;     // a chunk of totals holds something other than +0
  std::vector<std::uint8_t> chunk_untold;  // changed by a first part

  // What of each band is in the totals: its kept picture (if lit) plus its log.
  struct Band {
    std::vector<int> log;         // coefficients with an entry in `logged`
    std::uint64_t log_bytes = 0;  // of their columns
    std::uint64_t log_runs = 0;   // likewise
    HugePageVector<double> kept;  // as totals, or not allocated
    bool kept_lit = false;
    std::vector<int> shown;  // coefficients that moved since the band was last empty
    int lit = 0;             // how many of them are not zero
  };
  std::array<Band, HaarLayout::kMaxBands> band;
  std::vector<RgbD> shown;  // T * shown is what the totals stand for
  std::vector<std::uint8_t> in_shown;
  std::vector<RgbD> logged;  // sum of deltas since the band was last empty or folded
  std::vector<std::uint8_t> in_log;
  std::vector<std::uint64_t> bytes_of;
  std::vector<std::uint32_t> runs_of;  // chunks that have a column

  std::vector<WaveletDelta> columns_scratch;
  bool expect_resets = true, short_logs = false;

  // Follows the lighting itself; true if anything is lit afterwards.
  bool follow(const LightingUpdate& update) {
    const auto bands = static_cast<std::size_t>(transport.layout().band_count());
    int lit = 0;
    for (std::size_t b = 0; b < bands; ++b) {
      if (!update.reset[b]) continue;
      for (int index : band[b].shown) {
        shown[static_cast<std::size_t>(index)] = {};
        in_shown[static_cast<std::size_t>(index)] = 0;
      }
      band[b].shown.clear();
      band[b].lit = 0;
    }
    for (const WaveletDelta& delta : update.deltas) {
      const auto j = static_cast<std::size_t>(delta.index);
      Band& b = band[static_cast<std::size_t>(transport.layout().band_of(delta.index))];
      if (!in_shown[j]) {
        in_shown[j] = 1;
        b.shown.push_back(delta.index);
      }
      b.lit -= !(shown[j] == RgbD{});
      shown[j] += delta.delta;
      b.lit += !(shown[j] == RgbD{});
    }
    for (std::size_t b = 0; b < bands; ++b) lit += band[b].lit;
    return lit > 0;
  }

  void log(const WaveletDelta& delta) {
    const auto j = static_cast<std::size_t>(delta.index);
    Band& b = band[static_cast<std::size_t>(transport.layout().band_of(delta.index))];
    if (!in_log[j]) {
      in_log[j] = 1;
      b.log.push_back(delta.index);
      b.log_bytes += bytes_of[j];
      b.log_runs += runs_of[j];
    }
    logged[j] += delta.delta;
  }

  // The band with the longest log that is to be folded; null if none is.
  Band* to_fold() {
    Band* longest = nullptr;
    const std::uint64_t pictures = short_logs ? kShortPictures : kFoldPictures;
    for (Band& b : band) {
      const std::uint64_t least = longest ? longest->log_bytes : pictures * picture_bytes();
      if (expect_resets && b.log_bytes > least) longest = &b;
    }
    return longest;
  }

  void clear_log(Band& b) {
    for (int index : b.log) {
      logged[static_cast<std::size_t>(index)] = {};
      in_log[static_cast<std::size_t>(index)] = 0;
    }
    b.log.clear();
    b.log_bytes = b.log_runs = 0;
  }

  // Streams columns into rows laid out as totals; returns the bytes of sums read and written for
  // them. `before` prepares a chunk and says whether it changed something; `after` is told whether
  // the chunk changed.
  template <typename Before, typename After>
  std::uint64_t stream(std::span<const WaveletDelta> columns, HugePageVector<double>& sums,
                       const Before& before, const After& after) {
    std::atomic<std::uint64_t> blocks_touched{0};
    parallel_for(transport.chunk_count(), [&](int chunk) {
      thread_local std::vector<ColumnTask> tasks;
      tasks.clear();
      for (const WaveletDelta& column : columns) {
        const ColumnBlocks blocks = transport.column(chunk, column.index);
        if (!blocks.present) continue;
        tasks.push_back({blocks, {column.delta.r, column.delta.g, column.delta.b}});
        // A frame's columns are short runs far apart, which the hardware cannot foresee: ask for
        // all of them at once, so that memory works on many at a time. Long lists run on into each
        // other by themselves.
        if (columns.size() <= kPrefetchColumns) prefetch(blocks);
      }
      double* chunk_sums = sums.data() + static_cast<std::size_t>(chunk) * kChunkTotals;
      const bool changed = before(chunk, chunk_sums, !tasks.empty());
      if (!tasks.empty()) {
        apply_columns(transport.rgb_blocks(chunk), tasks, chunk_sums);
        blocks_touched.fetch_add(touched_blocks(tasks), std::memory_order_relaxed);
      }
      after(chunk, chunk_sums, changed || !tasks.empty());
    });
    return 2 * blocks_touched.load() * kBlockTotals * sizeof(double);
  }

  // The oldest columns of a log, of `bytes` together or a little more, into the kept picture.
  void fold(Band& b, std::uint64_t bytes, ApplyStats& stats) {
    std::size_t count = 0;
    std::uint64_t folded = 0;
    columns_scratch.clear();
    while (count < b.log.size() && folded < bytes) {
      const auto j = static_cast<std::size_t>(b.log[count++]);
      columns_scratch.push_back({static_cast<int>(j), logged[j]});
      folded += bytes_of[j];
      b.log_runs -= runs_of[j];
      logged[j] = {};
      in_log[j] = 0;
    }
    b.log.erase(b.log.begin(), b.log.begin() + static_cast<std::ptrdiff_t>(count));
    b.log_bytes -= folded;
    std::sort(columns_scratch.begin(), columns_scratch.end(),
              [](const WaveletDelta& x, const WaveletDelta& y) { return x.index < y.index; });
    const bool fresh = !b.kept_lit;
    if (b.kept.empty()) b.kept.resize(totals.size());
    stats.sum_bytes += stream(
        columns_scratch, b.kept,
        [&](int, double* sums, bool) {
          if (fresh) std::fill(sums, sums + kChunkTotals, 0.0);
          return fresh;
        },
        [](int, const double*, bool) {});
    if (fresh) stats.sum_bytes += picture_bytes();
    stats.transport_bytes += folded;
    stats.columns += static_cast<int>(columns_scratch.size());
    b.kept_lit = true;
  }
};

RowSums::RowSums(Transport transport) : state_(std::make_unique<State>(std::move(transport))) {}
RowSums::~RowSums() = default;
RowSums::RowSums(RowSums&&) noexcept = default;
RowSums& RowSums::operator=(RowSums&&) noexcept = default;

ApplyStats RowSums::apply(const LightingUpdate& update, const ChunkDone& done, UpdatePart part) {
  State& s = *state_;
  ApplyStats stats;
  const auto bands = static_cast<std::size_t>(s.transport.layout().band_count());

  // Nothing stays of the old light: start from zero, which is exact and reads no sums.
  const bool lit = s.follow(update);
  bool from_zero = true;
  for (std::size_t b = 0; b < bands; ++b) {
    from_zero &= update.reset[b] || (s.band[b].log.empty() && !s.band[b].kept_lit);
  }
  from_zero |= !lit;

  const bool may_fold = part != UpdatePart::rest && !from_zero && !update.empty();
  State::Band* longest = may_fold ? s.to_fold() : nullptr;
  if (longest && !update.reset[static_cast<std::size_t>(longest - s.band.data())]) {
    s.fold(*longest, s.picture_bytes(), stats);
  }

  // Gather the columns to stream: what reset bands logged, taken back, and the update's deltas.
  std::array<const double*, HaarLayout::kMaxBands> taken_back{};
  std::size_t taken_back_count = 0;
  for (std::size_t b = 0; b < bands; ++b) {
    if (!update.reset[b] && lit) continue;
    State::Band& band = s.band[b];
    if (from_zero) {
      s.clear_log(band);
    } else {
      for (int index : band.log) {
        // A log entry's mark stays set, so that a delta of this update meets it below.
        s.logged[static_cast<std::size_t>(index)] = -s.logged[static_cast<std::size_t>(index)];
      }
      if (band.kept_lit) taken_back[taken_back_count++] = band.kept.data();
    }
    band.kept_lit = false;
  }
  s.columns_scratch.clear();
  if (!lit) {
    // All light is out, whatever the deltas that got there.
  } else if (from_zero) {
    s.columns_scratch.assign(update.deltas.begin(), update.deltas.end());
  } else {
    for (const WaveletDelta& delta : update.deltas) {
      const auto j = static_cast<std::size_t>(delta.index);
      const auto b = static_cast<std::size_t>(s.transport.layout().band_of(delta.index));
      RgbD column = delta.delta;
      if (update.reset[b] && s.in_log[j]) {
        column += s.logged[j];
        s.logged[j] = {};
      }
      s.columns_scratch.push_back({delta.index, column});
    }
    for (std::size_t b = 0; b < bands; ++b) {
      if (!update.reset[b]) continue;
      for (int index : s.band[b].log) {
        const RgbD back = s.logged[static_cast<std::size_t>(index)];
        if (!(back == RgbD{})) s.columns_scratch.push_back({index, back});
      }
      s.clear_log(s.band[b]);
    }
    std::sort(s.columns_scratch.begin(), s.columns_scratch.end(),
              [](const WaveletDelta& a, const WaveletDelta& b) { return a.index < b.index; });
  }
  std::erase_if(s.columns_scratch, [](const WaveletDelta& d) { return d.delta == RgbD{}; });
  if (lit) {
    for (const WaveletDelta& delta : update.deltas) s.log(delta);
  }

  // Stream them, chunk by chunk: reset, apply and the caller's finish while a chunk is in cache.
  for (const WaveletDelta& column : s.columns_scratch) {
    stats.transport_bytes += s.bytes_of[static_cast<std::size_t>(column.index)];
  }
  stats.columns += static_cast<int>(s.columns_scratch.size());
  std::atomic<std::uint64_t> prepared{0};  // chunk passes over sums, to clear or take back
  stats.sum_bytes += s.stream(
      s.columns_scratch, s.totals,
      [&](int chunk, double* sums, bool has_columns) {
        std::uint8_t& chunk_lit = s.chunk_lit[static_cast<std::size_t>(chunk)];
        bool changed = false;
        if (from_zero && chunk_lit) {
          std::fill(sums, sums + kChunkTotals, 0.0);
          prepared.fetch_add(1, std::memory_order_relaxed);
          changed = true;
          chunk_lit = 0;
        }
        for (std::size_t k = 0; k < taken_back_count; ++k) {
          const double* back = taken_back[k] + static_cast<std::size_t>(chunk) * kChunkTotals;
          for (int i = 0; i < kChunkTotals; ++i) sums[i] -= back[i];
          prepared.fetch_add(3, std::memory_order_relaxed);
          changed = true;
        }
        if (has_columns) chunk_lit = 1;
        return changed;
      },
      [&](int chunk, const double* sums, bool changed) {
        std::uint8_t& untold = s.chunk_untold[static_cast<std::size_t>(chunk)];
        if (part == UpdatePart::first) {
          untold |= static_cast<std::uint8_t>(changed);
        } else if (changed || untold) {
          untold = 0;
          if (done) done(chunk, sums);
        }
      });
  stats.sum_bytes += prepared.load() * kChunkTotals * sizeof(double);

  // A picture that starts anew with all of its light has long logs, and time: frames after it not.
  if (from_zero && part != UpdatePart::rest) {
    while (State::Band* band = s.to_fold()) s.fold(*band, band->log_bytes, stats);
  }
  return stats;
}

void RowSums::expect_resets(bool expected) { state_->expect_resets = expected; }
void RowSums::keep_logs_short(bool keep) { state_->short_logs = keep; }

std::uint64_t RowSums::reset_bytes(int band) const {
  const State::Band& b = state_->band[static_cast<std::size_t>(band)];
  return b.log_bytes + (b.kept_lit ? 3 * state_->picture_bytes() : 0);
}

std::uint64_t RowSums::fold_bytes() const {
  const State::Band* longest = state_->to_fold();
  // A picture's worth of columns, and the kept picture read and written.
  return longest ? 3 * state_->picture_bytes() : 0;
}

std::uint64_t RowSums::reset_runs(int band) const {
  return state_->band[static_cast<std::size_t>(band)].log_runs;
}

std::uint64_t RowSums::fold_runs() const {
  const State::Band* longest = state_->to_fold();
  return longest ? longest->log_runs * state_->picture_bytes() / longest->log_bytes : 0;
}

std::uint64_t RowSums::column_runs(int index) const {
  return state_->runs_of[static_cast<std::size_t>(index)];
}

const Transport& RowSums::transport() const { return state_->transport; }
std::span<const double> RowSums::totals() const { return state_->totals; }

std::uint64_t RowSums::extra_bytes() const {
  const State& s = *state_;
  std::uint64_t bytes = s.picture_bytes() + 2 * s.logged.size() * (sizeof(RgbD) + 1) +
                        12 * s.bytes_of.size() +
                        s.columns_scratch.capacity() * sizeof(WaveletDelta);
  for (const auto& band : s.band) {
    bytes += band.kept.size() * sizeof(double) + 4 * (band.log.size() + band.shown.size());
  }
  return bytes;
}

}  // namespace haarlight
