// Finds the number of wavelets that keeps a frame within a time.

#pragma once

namespace haarlight::viewer {

/// After each frame the number moves by the root of wanted over measured time. Time grows with the
/// number, at most in proportion, so that the distance to the right number, in logarithms, shrinks
/// to between a half and all of what it was, and never overshoots.
class BudgetController {
 public:
  /// How many wavelets the next frame may change; [1, most].
  int wavelets() const;

  /// Tells what a frame took that was allowed wavelets() and changed `updates`. A frame that had
  /// less to do than it was allowed only says whether that was too much.
  void measured(double milliseconds, int updates, double wanted_milliseconds, int most);

 private:
  double wavelets_ = 30;
};

}  // namespace haarlight::viewer
