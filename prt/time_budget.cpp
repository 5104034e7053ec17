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
constexpr std::size_t kWarm = 16;     // frames after which outliers are known as such

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

// Of frames like this one; before there were any, of the others.
const FrameTimeModel& TimeBudget::like_this(const Models& models) const {
  return models[models[folds()].known() ? folds() : 1 - folds()];
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
  const double bytes = parts_ ? like_this(first_).bytes_within(left - second_.predict(0))
                              : like_this(whole_).bytes_within(left);
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
  allowed_ = parts_ ? like_this(first_).bytes_within(
                          std::min(kFirstPart * wanted_, end - second_.predict(0)) - begun_ms_)
                    : like_this(whole_).bytes_within(end - begun_ms_);
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
  FrameTimeModel& last = parts_ ? second_ : whole_[folds()];
  const double predicted = (parts_ ? second_ : like_this(whole_)).predict(moved_);
  const double before = parts_ ? resumed_ms_ : begun_ms_;
  const bool warm = slower_.size() >= kWarm;
  // Of a frame that was held up, no more than this.
  const auto learn = [&](FrameTimeModel& model, double bytes, double took) {
    model.add(bytes,
              warm && model.known() ? std::min(took, kOutlier * model.predict(bytes)) : took);
  };
  remember(warm ? milliseconds / (before + predicted) : slower_.empty() ? kSlowAtFirst : 1);
  if (parts_) learn(first_[folds()], moved_first_, resumed_ms_ - begun_ms_);
  learn(last, moved_, milliseconds - before);
  most_moved_ = std::max(most_moved_, moved_first_ + moved_);
}

}  // namespace haarlight
