// Fits time to bytes, and takes wavelets until the time is spent.

#include "prt/time_budget.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace haarlight {
namespace {

constexpr double kForget = 0.98;       // of a frame's weight, by the next frame
constexpr double kPriorSpread = 0.05;  // of bytes, relative, squared: what the prior weighs
constexpr std::size_t kRemembered = 200;
constexpr std::size_t kMaySlip = 1;   // frames of kRemembered that may be slower than the slack
constexpr double kSlack = 1.04;       // of the 1.1 that are promised: the future is a little worse
constexpr double kSlowAtFirst = 1.2;  // as if one such frame had been seen
constexpr double kFirstPart = 0.65;   // of the time, after which the first part is to be done
constexpr double kLeastAim = 0.85;    // below that, time asked for would be left unspent
constexpr double kMostAim = 0.92;     // the second part may be held up, too
constexpr double kOutlier = 1.5;      // a frame that took so much longer was held up by others
// Of a byte that is folded, against one of a column; what the last such frame weighs.
constexpr double kFastestFold = 0.05, kSlowestFold = 2, kNewFold = 0.3;
constexpr double kLeastOfOthers = 0.1;  // of the time of a frame that folds
constexpr std::size_t kWarm = 16;       // frames after which outliers are known as such

}  // namespace

void FrameTimeModel::add(double bytes, double milliseconds) {
  weight_ = kForget * weight_ + 1;
  bytes_ = kForget * bytes_ + bytes;
  time_ = kForget * time_ + milliseconds;
  bytes_bytes_ = kForget * bytes_bytes_ + bytes * bytes;
  bytes_time_ = kForget * bytes_time_ + bytes * milliseconds;
  const double mean_bytes = bytes_ / weight_, mean_time = time_ / weight_;
  if (!(mean_bytes > 0) || !(mean_time > 0)) return;
  const double variance = std::max(0.0, bytes_bytes_ / weight_ - mean_bytes * mean_bytes);
  const double covariance = bytes_time_ / weight_ - mean_bytes * mean_time;
  // Ridge towards "half is fixed"; neither part may be negative.
  const double prior = kPriorSpread * mean_bytes * mean_bytes;
  const double half = 0.5 * mean_time / mean_bytes;
  per_byte_ = std::clamp((covariance + prior * half) / (variance + prior), 0.1 * half, 2 * half);
  fixed_ = mean_time - per_byte_ * mean_bytes;
}

double FrameTimeModel::bytes_within(double milliseconds) const {
  return std::max(0.0, (milliseconds - fixed_) / per_byte_);
}

void FoldTimeModel::add(double bytes, double folded, double milliseconds) {
  if (folded > 0 && others_.known()) {
    const double per_byte = others_.per_byte();
    const double now = std::clamp((milliseconds - others_.predict(bytes - folded)) / folded,
                                  kFastestFold * per_byte, kSlowestFold * per_byte);
    per_folded_ = per_folded_ < 0 ? now : per_folded_ + kNewFold * (now - per_folded_);
  }
  const double of_folds = per_folded_ < 0 ? 0 : per_folded_ * folded;
  if (others_.known() && folded > 0) {
    others_.add(bytes - folded, std::max(milliseconds - of_folds, kLeastOfOthers * milliseconds));
  } else {
    others_.add(bytes, milliseconds);
  }
}

TimeBudget::TimeBudget(std::vector<double> column_bytes) : column_bytes_(std::move(column_bytes)) {
  slower_.reserve(kRemembered);
  sorted_.reserve(kRemembered);
}

double TimeBudget::aim() const {
  if (slower_.size() < kWarm) return kLeastAim;
  sorted_ = slower_;
  const std::size_t slips = kMaySlip * sorted_.size() / kRemembered;
  const auto nth = sorted_.end() - static_cast<std::ptrdiff_t>(slips) - 1;
  std::nth_element(sorted_.begin(), nth, sorted_.end());
  return std::clamp(kSlack / *nth, kLeastAim, parts_ ? kMostAim : 1.0);
}

double TimeBudget::elapsed() const {
  return std::chrono::duration<double, std::milli>(now_() - started_).count();
}

void TimeBudget::start(double milliseconds, Clock::time_point now,
                       std::span<const double> reset_bytes, double fixed_bytes, bool parts) {
  wanted_ = milliseconds;
  started_ = now;
  reset_bytes_.fill(0);
  std::copy(reset_bytes.begin(), reset_bytes.end(), reset_bytes_.begin());
  fixed_bytes_ = fixed_bytes;
  moved_ = moved_first_ = 0;
  any_ = false;
  parts_ = parts;
  put_off_.reset();
}

// Where nothing of the old light stays, sums start from zero and nothing is streamed back.
double TimeBudget::to_take_back(const BandMask& reset) const {
  double bytes = 0;
  bool from_zero = true;
  for (std::size_t b = 0; b < reset_bytes_.size(); ++b) {
    if (reset[b]) bytes += reset_bytes_[b];
    from_zero = from_zero && (reset[b] || reset_bytes_[b] == 0);
  }
  return from_zero ? 0 : bytes;
}

BandMask TimeBudget::allow(const BandMask& wanted, std::span<const double> gain) {
  const double left = aim() * wanted_ - elapsed();
  const double bytes = parts_ ? first_.bytes_within(left - second_.predict(0), fixed_bytes_)
                              : whole_.bytes_within(left, fixed_bytes_);
  if (fixed_bytes_ + to_take_back(wanted) <= bytes) return wanted;
  // The most gain for its bytes first, as long as they fit.
  BandMask allowed, seen;
  for (;;) {
    std::size_t best = reset_bytes_.size();
    for (std::size_t b = 0; b < gain.size(); ++b) {
      if (!wanted[b] || seen[b]) continue;
      // gain / bytes, without dividing by bytes that may be 0.
      if (best == reset_bytes_.size() ||
          gain[b] * reset_bytes_[best] > gain[best] * reset_bytes_[b]) {
        best = b;
      }
    }
    if (best == reset_bytes_.size()) {
      put_off_ = wanted & ~allowed;
      return allowed;
    }
    seen[best] = true;
    BandMask more = allowed;
    more[best] = true;
    if (fixed_bytes_ + to_take_back(more) <= bytes) allowed = more;
  }
}

void TimeBudget::begin(std::span<const Rgb>, std::span<const Rgb>, const BandMask& reset) {
  begun_ms_ = elapsed();
  moved_ = fixed_bytes_ + to_take_back(reset);
  const double end = aim() * wanted_;
  allowed_ = parts_ ? first_.bytes_within(
                          std::min(kFirstPart * wanted_, end - second_.predict(0)) - begun_ms_,
                          fixed_bytes_)
                    : whole_.bytes_within(end - begun_ms_, fixed_bytes_);
  if (most_moved_ > 0) allowed_ = std::min(allowed_, 2 * most_moved_);
}

void TimeBudget::resume() {
  resumed_ms_ = elapsed();
  moved_first_ = moved_;
  moved_ = 0;
  allowed_ = second_.bytes_within(aim() * wanted_ - resumed_ms_);
  if (most_moved_ > 0) allowed_ = std::min(allowed_, 2 * most_moved_);
}

bool TimeBudget::take(int index, const Rgb&) {
  // One at least, so that every light arrives.
  const double bytes = column_bytes_[static_cast<std::size_t>(index)];
  if (any_ && moved_ + bytes > allowed_) return false;
  moved_ += bytes;
  any_ = true;
  return true;
}

// Measured over predicted time.
void TimeBudget::remember(double ratio) {
  if (slower_.size() < kRemembered) {
    slower_.push_back(ratio);
  } else {
    slower_[next_slower_] = ratio;
    next_slower_ = (next_slower_ + 1) % kRemembered;
  }
}

void TimeBudget::finish(double milliseconds) {
  if (!any_) return;  // nothing was done, and nothing is learnt
  const double predicted = parts_ ? second_.predict(moved_) : whole_.predict(moved_, fixed_bytes_);
  const double before = parts_ ? resumed_ms_ : begun_ms_;
  const bool warm = slower_.size() >= kWarm;
  remember(warm ? milliseconds / (before + predicted) : slower_.empty() ? kSlowAtFirst : 1);
  // Of a frame that was held up, no more than this is learnt.
  const auto at_most = [&](double took, double foreseen) {
    return warm ? std::min(took, kOutlier * foreseen) : took;
  };
  if (parts_) {
    const double took = resumed_ms_ - begun_ms_;
    first_.add(moved_first_, fixed_bytes_,
               at_most(took, first_.predict(moved_first_, fixed_bytes_)));
    second_.add(moved_, at_most(milliseconds - before, predicted));
  } else {
    whole_.add(moved_, fixed_bytes_, at_most(milliseconds - before, predicted));
  }
  most_moved_ = std::max(most_moved_, moved_first_ + moved_);
}

}  // namespace haarlight
