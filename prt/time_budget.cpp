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
constexpr double kSlack = 1.06;       // of the 1.1 that are promised: the future is a little worse
constexpr double kSlowAtFirst = 1.2;  // as if one such frame had been seen
constexpr double kLeastAim = 0.85;    // below that, time asked for would be left unspent
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
  return std::clamp(kSlack / *nth, kLeastAim, 1.0);
}

void TimeBudget::start(double milliseconds, Clock::time_point now,
                       std::span<const double> reset_bytes, double fixed_bytes) {
  wanted_ = milliseconds;
  started_ = now;
  std::copy(reset_bytes.begin(), reset_bytes.end(), reset_bytes_.begin());
  fixed_bytes_ = fixed_bytes;
  moved_ = 0;
  any_ = false;
}

void TimeBudget::begin(std::span<const Rgb>, std::span<const Rgb>, const BandMask& reset) {
  begun_ms_ = std::chrono::duration<double, std::milli>(now_() - started_).count();
  // Where nothing of the old light stays, sums start from zero and nothing is streamed back.
  bool from_zero = true;
  for (std::size_t b = 0; b < reset_bytes_.size(); ++b) {
    from_zero = from_zero && (reset[b] || reset_bytes_[b] == 0);
  }
  moved_ = fixed_bytes_;
  for (std::size_t b = 0; !from_zero && b < reset_bytes_.size(); ++b) {
    if (reset[b]) moved_ += reset_bytes_[b];
  }
  allowed_ = model_.bytes_within(aim() * wanted_ - begun_ms_);
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

void TimeBudget::finish(double milliseconds) {
  if (!any_) return;  // nothing was done, and nothing is learnt
  const double after = milliseconds - begun_ms_, predicted = model_.predict(moved_);
  if (slower_.size() < kWarm) {
    model_.add(moved_, after);
    slower_.push_back(slower_.empty() ? kSlowAtFirst : 1);
  } else {
    const double ratio = milliseconds / (begun_ms_ + predicted);
    if (slower_.size() < kRemembered) {
      slower_.push_back(ratio);
    } else {
      slower_[next_slower_] = ratio;
      next_slower_ = (next_slower_ + 1) % kRemembered;
    }
    model_.add(moved_, std::min(after, kOutlier * predicted));
  }
  most_moved_ = std::max(most_moved_, moved_);
}

}  // namespace haarlight
