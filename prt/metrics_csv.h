// Frame metrics as a comma separated file, one row a frame.

#pragma once

#include <filesystem>
#include <string>

#include "core/atomic_file.h"
#include "prt/relight_sequence.h"

namespace haarlight {

/// The names of the columns, without a newline:
/// frame,method,wavelets,weight,updates,resets,lighting_error,image_rel_rmse,image_max_abs,
/// update_ms,apply_ms,finish_ms,total_ms,bytes,flicker,error_estimate,error_bound,transport_error
std::string metrics_csv_header();

/// One row, without a newline. Fields that were not measured are empty. Errors carry nine
/// significant digits, so that a float survives the way through text; times four decimals.
std::string metrics_csv_row(const FrameMetrics& metrics);

/// A metrics file that appears under its name when commit() is called, complete, or not at all.
/// Every call throws Error{io} naming the file, the constructor too, so that a place that cannot be
/// written is known before the first frame.
class MetricsCsvWriter {
 public:
  explicit MetricsCsvWriter(const std::filesystem::path& file);
  void add(const FrameMetrics& metrics);
  void commit();

 private:
  void write_line(std::string line);
  AtomicFile file_;
};

}  // namespace haarlight
