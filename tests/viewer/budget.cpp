// The number of wavelets that fits a time, on clocks that are made up.

#include "viewer/budget.h"

#include <gtest/gtest.h>

#include <cmath>

namespace haarlight::viewer {
namespace {

constexpr int kMost = 24576;

// Time is fixed + each * n: the number that fits is (wanted - fixed) / each. Logarithmic distances
// at least halve in so many frames that a factor of a thousand is gone long before 200.
TEST(BudgetController, FindsTheNumberThatFits) {
  for (const double fixed : {0.0, 0.4, 3.0}) {
    for (const double each : {0.0005, 0.02, 0.3}) {
      for (const double wanted : {4.0, 8.0, 16.0}) {
        BudgetController budget;
        for (int frame = 0; frame < 200; ++frame) {
          const int n = budget.wavelets();
          budget.measured(fixed + each * n, n, wanted, kMost);
        }
        const double best = std::min<double>((wanted - fixed) / each, kMost);
        EXPECT_NEAR(budget.wavelets(), best, std::max(1.0, 0.02 * best))
            << fixed << " + " << each << " n = " << wanted;
      }
    }
  }
}

TEST(BudgetController, NeverOvershoots) {
  BudgetController budget;
  int before = budget.wavelets();
  for (int frame = 0; frame < 100; ++frame) {
    budget.measured(1 + 0.01 * before, before, 8, kMost);
    EXPECT_GE(budget.wavelets(), before);
    EXPECT_LE(1 + 0.01 * budget.wavelets(), 8 + 0.01);
    before = budget.wavelets();
  }
}

TEST(BudgetController, ALightAtRestTeachesNothing) {
  BudgetController budget;
  const int before = budget.wavelets();
  for (int frame = 0; frame < 100; ++frame) budget.measured(0.01, 0, 8, kMost);
  EXPECT_EQ(budget.wavelets(), before);
}

TEST(BudgetController, StaysInRangeWhateverTheClockSays) {
  BudgetController budget;
  for (int frame = 0; frame < 100; ++frame) budget.measured(1e9, budget.wavelets(), 1, kMost);
  EXPECT_EQ(budget.wavelets(), 1);
  for (int frame = 0; frame < 100; ++frame) budget.measured(0, budget.wavelets(), 1, kMost);
  EXPECT_EQ(budget.wavelets(), kMost);
}

}  // namespace
}  // namespace haarlight::viewer
