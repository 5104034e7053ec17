// As few wavelets as keep the estimated error of the picture small enough.

#pragma once

#include "prt/error_judge.h"
#include "prt/update_limit.h"

namespace haarlight {

class ErrorLimit final : public UpdateLimit {
 public:
  /// Takes wavelets until estimator.estimate() is at most `error`; one at least where there is one,
  /// so that a light at rest arrives. The estimator must outlive it.
  ErrorLimit(ErrorJudge& estimator, double error) : estimator_(estimator), error_(error) {}

  void begin(std::span<const Rgb> target, std::span<const Rgb> shown, const BandMask&) override {
    estimator_.begin(target, shown);
    any_ = false;
  }
  bool take(int index, const Rgb& difference) override {
    if (any_ && estimator_.estimate() <= error_) return false;
    estimator_.take(index, difference);
    any_ = true;
    return true;
  }

 private:
  ErrorJudge& estimator_;
  double error_;
  bool any_ = false;
};

}  // namespace haarlight
