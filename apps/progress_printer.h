// Shows how far long work is: a bar on a terminal, a line every tenth otherwise.

#pragma once

#include <chrono>
#include <string>

namespace haarlight {

/// Prints on standard error. Not for several threads at once.
class ProgressPrinter {
 public:
  explicit ProgressPrinter(std::string label);
  ~ProgressPrinter();  ///< leaves the terminal on a fresh line
  ProgressPrinter(const ProgressPrinter&) = delete;
  ProgressPrinter& operator=(const ProgressPrinter&) = delete;

  /// `share` in [0, 1]. Returns false when the user asked to stop, as Progress wants it.
  bool operator()(double share);

  /// What is done a second, for the next lines: `count` of `unit` in `seconds`.
  void set_rate(double count, double seconds, const std::string& unit);

 private:
  std::string label_;
  std::string rate_;
  std::chrono::steady_clock::time_point begin_;
  double begin_share_ = -1;  // first share told of: what was there before is not this run's work
  bool terminal_;
  bool bar_drawn_ = false;
  int last_percent_ = -1;  // drawn last; in steps of ten without a terminal
};

}  // namespace haarlight
