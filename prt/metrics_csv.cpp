// Writes frame metrics as text.

#include "prt/metrics_csv.h"

#include <fmt/format.h>

namespace haarlight {
namespace {

std::string optional_number(const std::optional<double>& value) {
  return value ? fmt::format("{:.9g}", *value) : std::string();
}

}  // namespace

std::string metrics_csv_header() {
  return "frame,method,wavelets,weight,updates,resets,lighting_error,image_rel_rmse,image_max_abs,"
         "update_ms,apply_ms,finish_ms,total_ms,bytes,flicker,error_estimate,error_bound,"
         "transport_error";
}

std::string metrics_csv_row(const FrameMetrics& m) {
  return fmt::format("{},{},{},{},{},{},{:.9g},{},{},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{},{}",
                     m.frame, lighting_method_name(m.method), m.wavelets,
                     wavelet_weight_name(m.weight), m.updates, m.resets, m.lighting_error,
                     optional_number(m.image_rel_rmse), optional_number(m.image_max_abs),
                     m.update_ms, m.apply_ms, m.finish_ms, m.total_ms, m.bytes,
                     optional_number(m.flicker), optional_number(m.error_estimate),
                     optional_number(m.error_bound), optional_number(m.transport_error));
}

MetricsCsvWriter::MetricsCsvWriter(const std::filesystem::path& file) : file_(file) {
  write_line(metrics_csv_header());
}

void MetricsCsvWriter::add(const FrameMetrics& metrics) { write_line(metrics_csv_row(metrics)); }

void MetricsCsvWriter::commit() { file_.commit(); }

void MetricsCsvWriter::write_line(std::string line) {
  line += '\n';
  file_.write(line.data(), line.size());
}

}  // namespace haarlight
