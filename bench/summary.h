// Keeps what the cases measured and prints the ratios that matter.

#pragma once

#include <benchmark/benchmark.h>

#include <map>
#include <string>

namespace haarlight::bench {

/// The console report, remembering the median of every case.
class Collector : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override;
  /// Prints ratios between cases of this same run; a line is left out when a case it needs was
  /// filtered away.
  void print_summary() const;

 private:
  struct Case {
    double milliseconds = 0;  // wall time of an iteration, or of a frame where the case says so
    std::map<std::string, double> counters;
  };
  const Case* find(const std::string& name) const;
  void print_light() const;  // bench/summary_light.cpp

  std::map<std::string, Case> median_;
};

}  // namespace haarlight::bench
