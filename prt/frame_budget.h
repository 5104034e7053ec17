// What a frame may cost, or must be worth.

#pragma once

namespace haarlight {

enum class BudgetKind {
  wavelets,      ///< so many wavelets a frame (LightingOptions::wavelets)
  milliseconds,  ///< as many as keep deciding, applying and finishing within so much time a frame
  error,         ///< as few as keep the estimated relative error of the picture at or below this
};

struct FrameBudget {
  BudgetKind kind = BudgetKind::wavelets;
  double value = 0;  ///< > 0: milliseconds, or an error; of no meaning for wavelets
  bool operator==(const FrameBudget&) const = default;
};

}  // namespace haarlight
