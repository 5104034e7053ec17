// The one place where updates meet transport: running sums of T * shown, one per row.

#pragma once

#include <functional>
#include <memory>
#include <span>

#include "prt/lighting_update.h"
#include "prt/transport.h"

namespace haarlight {

/// What a frame moved, in bytes of memory traffic asked for, and how long it took.
struct ApplyStats {
  std::uint64_t transport_bytes = 0;  ///< of T, with its bitmaps
  std::uint64_t sum_bytes = 0;        ///< of running sums and kept bands, read and written
  int columns = 0;                    ///< columns streamed, those that take a reset band back too
};

/// Keeps total = T * shown for every row in double precision.
///
/// Overbeck 2006 keeps a picture for every band, so that a band can be thrown away, and adds them
/// up each frame. With compressed columns a band's picture costs as much traffic as dozens of
/// columns, so here only the total is kept up to date, beside a log per band of what was added
/// since the band was last empty (or last folded). A reset takes the logged columns back; a log
/// that has grown past a few pictures' worth of bytes is folded into a kept picture of the band,
/// once, so that a later reset subtracts that instead. Bands that never reset need no picture. One
/// band is folded in a frame, in part, and only if the frame does not reset it.
///
/// Accuracy: |total - T shown| <= (K + 2n) 2^-53 S, K the updates since the sums were last empty,
/// n the terms of one sum, S the largest sum |T| |shown| met. When nothing is shown the total is +0
/// bit for bit.
/// Of a frame whose update comes in one or in two calls, so that the clock can be looked at between
/// them.
enum class UpdatePart {
  whole,
  first,  ///< sums alone; who looks at chunks is told by the rest
  rest,   ///< hands out the chunks of both; may be empty
};

class RowSums {
 public:
  explicit RowSums(Transport transport);
  ~RowSums();
  RowSums(RowSums&&) noexcept;
  RowSums& operator=(RowSums&&) noexcept;

  /// Called for every chunk whose rows changed, from the thread that just changed them and while
  /// they are in its cache. `totals` is kChunkRows * 3 values, [block][channel][row of block].
  using ChunkDone = std::function<void(int chunk, const double* totals)>;

  /// Applies an update. Rows are owned by chunks and each row adds its columns in ascending order,
  /// so the result is the same bits on any number of threads. No heap use once warm, except that a
  /// band's kept picture is allocated when first needed. Requires deltas ascending and in range.
  /// `done` is not called in the first of two parts, and for the chunks of both in the rest, which
  /// folds no log. A rest must follow its first.
  ApplyStats apply(const LightingUpdate& update, const ChunkDone& done = {},
                   UpdatePart part = UpdatePart::whole);

  /// Whether single bands will be reset (true from the start). A caller whose bands never are (bi,
  /// reference) says no, and no band's log is folded: no kept pictures, and no time for them.
  void expect_resets(bool expected);
  /// Whether logs are folded when they are a picture long rather than four: updates move more, and
  /// the dearest reset half as much. For frames that must not take longer than others.
  void keep_logs_short(bool keep);

  /// Traffic of the next update beside its columns, in bytes: what taking back band `band` would
  /// stream, and what a long log asks for unless its band is reset.
  std::uint64_t reset_bytes(int band) const;
  std::uint64_t fold_bytes() const;
  /// Likewise, in how many runs its columns would be read: one a column and chunk that has it.
  std::uint64_t reset_runs(int band) const;
  std::uint64_t fold_runs() const;
  /// Of one column.
  std::uint64_t column_runs(int index) const;

  const Transport& transport() const;
  /// All totals: rows() * 3 values, [block][channel][row of block].
  std::span<const double> totals() const;
  /// Memory this object holds beside the transport, in bytes.
  std::uint64_t extra_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace haarlight
