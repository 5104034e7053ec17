// As many wavelets as a frame's time allows, on this machine, as it is now.

#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <span>
#include <vector>

#include "prt/update_limit.h"
#include "wavelet/haar.h"

namespace haarlight {

/// A frame beyond deciding takes fixed + per_byte * bytes, bytes of columns to stream and of bands
/// to take back, which are known before. Both numbers are fitted to the frames that were measured,
/// the last fifty or so; where bytes vary too little to tell them apart, half of the time is taken
/// as fixed.
class FrameTimeModel {
 public:
  /// A frame that had `bytes` to move took `milliseconds`.
  void add(double bytes, double milliseconds);
  double predict(double bytes) const { return fixed_ + per_byte_ * bytes; }
  double per_byte() const { return per_byte_; }
  /// Whether anything was measured.
  bool known() const { return weight_ > 0; }
  /// The most bytes that are predicted to take at most so long; 0 if none.
  double bytes_within(double milliseconds) const;

 private:
  double weight_ = 0, bytes_ = 0, time_ = 0, bytes_bytes_ = 0, bytes_time_ = 0;
  double fixed_ = 0, per_byte_ = 1 / 4e6;  // 4 GB/s, until something is known
};

/// The same of frames that may fold logs beside, whose bytes are streamed and take less time each
/// than those of columns: what they take is learnt apart, from what such frames took more than
/// others would have. Before there were any, they count as columns.
class FoldTimeModel {
 public:
  /// `folded` of the bytes were folded.
  void add(double bytes, double folded, double milliseconds);
  double predict(double bytes, double folded) const {
    return others_.predict(bytes - folded) + per_folded() * folded;
  }
  double bytes_within(double milliseconds, double folded) const {
    return folded + others_.bytes_within(milliseconds - per_folded() * folded);
  }

 private:
  double per_folded() const { return per_folded_ < 0 ? others_.per_byte() : per_folded_; }

  FrameTimeModel others_;
  double per_folded_ = -1;  // below 0: not known yet
};

/// Ends updates so that frames stay within a time. Where the renderer takes a frame in two parts,
/// the first is to be done after two thirds of the time, whatever the second still costs; then
/// the clock says what is left for the second, so that a thread that was held up meanwhile makes
/// the update smaller and not the frame late. It aims below the time by as much as frames have been
/// slower than predicted lately: all but the slowest of the last 200 would have stayed within 1.04
/// times the time asked for. At least 85 % of it is aimed at. Bands are reset if taking them back
/// is foreseen to fit, the most worth it first.
class TimeBudget final : public UpdateLimit {
 public:
  using Clock = std::chrono::steady_clock;

  /// Bytes of each coefficient's column.
  explicit TimeBudget(std::vector<double> column_bytes);

  /// A frame begins, now, that is to take `milliseconds`. `reset_bytes` of each band and
  /// `fixed_bytes` are what it would move beside columns.
  /// `parts`: whether resume() follows.
  void start(double milliseconds, Clock::time_point now, std::span<const double> reset_bytes,
             double fixed_bytes, bool parts);
  /// The first part is applied, now; what is taken from here on is the second.
  void resume();
  /// The frame took so long, deciding and all.
  void finish(double milliseconds);

  /// Bands of this frame that were not allowed.
  const BandMask& put_off() const { return put_off_; }

  BandMask allow(const BandMask& wanted, std::span<const double> gain) override;
  void begin(std::span<const Rgb> target, std::span<const Rgb> shown,
             const BandMask& reset) override;
  bool take(int index, const Rgb& difference) override;

  /// Another clock than the machine's: for tests.
  void set_clock(Clock::time_point (*now)()) { now_ = now; }

 private:
  double aim() const;
  double elapsed() const;
  double to_take_back(const BandMask& reset) const;
  void remember(double ratio);

  std::vector<double> column_bytes_;
  FoldTimeModel whole_, first_;  // of frames in one part, and of first parts
  FrameTimeModel second_;
  Clock::time_point (*now_)() = &Clock::now;
  std::array<double, HaarLayout::kMaxBands> reset_bytes_{};

  // Of the frame.
  double wanted_ = 0, fixed_bytes_ = 0, begun_ms_ = 0, resumed_ms_ = 0;
  double moved_ = 0, allowed_ = 0;  // of the part
  double moved_first_ = 0;
  Clock::time_point started_;
  bool any_ = false, parts_ = false;
  BandMask put_off_;

  double most_moved_ = 0;       // of frames so far: growth is at most twofold
  std::vector<double> slower_;  // measured over predicted time, of the last frames, as a ring
  std::size_t next_slower_ = 0;
  mutable std::vector<double> sorted_;
};

}  // namespace haarlight
