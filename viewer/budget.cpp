// Adapts a number of wavelets to a time.

#include "viewer/budget.h"

#include <algorithm>
#include <cmath>

namespace haarlight::viewer {

int BudgetController::wavelets() const { return static_cast<int>(std::lround(wavelets_)); }

void BudgetController::measured(double milliseconds, int updates, double wanted_milliseconds,
                                int most) {
  // One frame held up by something else must not throw the number off: at most halve or double.
  const double ratio = wanted_milliseconds / std::max(milliseconds, 1e-3);
  const double factor = std::clamp(std::sqrt(ratio), 0.5, 2.0);
  if (factor > 1 && updates < wavelets()) return;
  wavelets_ = std::clamp(wavelets_ * factor, 1.0, static_cast<double>(most));
}

}  // namespace haarlight::viewer
