// Ratios between cases.

#include "bench/summary.h"

#include <fmt/format.h>

#include <algorithm>

namespace haarlight::bench {

void Collector::ReportRuns(const std::vector<Run>& runs) {
  ConsoleReporter::ReportRuns(runs);
  for (const Run& run : runs) {
    if (run.error_occurred || run.aggregate_name != "median") continue;
    Case& entry = median_[run.run_name.function_name];
    entry.milliseconds = run.GetAdjustedRealTime();  // every case reports milliseconds
    for (const auto& [name, counter] : run.counters) entry.counters[name] = counter.value;
  }
}

const Collector::Case* Collector::find(const std::string& name) const {
  const auto it = median_.find(name);
  return it == median_.end() ? nullptr : &it->second;
}

void Collector::print_summary() const {
  fmt::print("\nRatios (medians of this run)\n");
  const Case* read = find("memory.read");
  for (const auto& [name, entry] : median_) {
    const auto bytes = entry.counters.find("bytes_per_second");
    if (!read || &entry == read || bytes == entry.counters.end()) continue;
    const double whole = read->counters.at("bytes_per_second");
    fmt::print("  {:<18} {:8.3f} ms, {:5.1f} GB/s, {:.0f} % of the read bandwidth of {:.1f} GB/s",
               name, entry.milliseconds, bytes->second / 1e9, 100 * bytes->second / whole,
               whole / 1e9);
    const auto moved = entry.counters.find("MB");
    if (moved != entry.counters.end()) fmt::print(", {:.3f} MB", moved->second);
    const auto transport = entry.counters.find("transport_bytes_per_second");
    if (transport != entry.counters.end()) {
      fmt::print(" (transport alone {:.0f} %)", 100 * transport->second / whole);
    }
    fmt::print("\n");
  }
  if (const Case* gaps = find("machine.gaps")) {
    fmt::print(
        "  spinning threads lose {:.2f} % of their time in gaps above 0.1 ms; {:.2f} % of 4 ms "
        "frames meet one above 0.4 ms\n",
        gaps->counters.at("lost_percent"), gaps->counters.at("hit_percent_4ms"));
  }
  const Case* pbi = find("frame.pbi.k30");
  const Case* nwa = find("frame.nwa.k30");
  if (pbi && nwa) {
    fmt::print("  PBI frame / NWA frame at 30 wavelets: {:.3f} / {:.3f} ms = {:.2f}\n",
               pbi->counters.at("ms_per_frame"), nwa->counters.at("ms_per_frame"),
               pbi->counters.at("ms_per_frame") / nwa->counters.at("ms_per_frame"));
    fmt::print("  PBI beside the transport: {:.1f} MiB, {:.1f} % of it\n",
               pbi->counters.at("extra_bytes") / 1048576,
               100 * pbi->counters.at("extra_bytes") / pbi->counters.at("transport_file_bytes"));
    fmt::print("  at equal milliseconds, mean lighting error while moving:\n");
    for (const auto& [name, entry] : median_) {
      if (name.rfind("frame.", 0) != 0) continue;
      fmt::print("    {:<16} {:7.3f} ms  error {:.3f}\n", name, entry.counters.at("ms_per_frame"),
                 entry.counters.at("lighting_error"));
    }
  }
  for (const char* k : {"k30", "k100"}) {
    const Case* exact = find(fmt::format("sums.double.{}", k));
    const Case* rough = find(fmt::format("sums.float.{}", k));
    const Case* whole = find(fmt::format("frame.bi.{}", k));
    if (!exact || !rough) continue;
    const double of_double = exact->counters.at("ms_per_frame");
    const double of_float = rough->counters.at("ms_per_frame");
    fmt::print("  sums in double / in float, {}: {:.3f} / {:.3f} ms, drift {:.1e} / {:.1e}", k,
               of_double, of_float, exact->counters.at("drift"), rough->counters.at("drift"));
    if (whole) {
      const double frame = whole->counters.at("ms_per_frame");
      const double cost = (of_double - of_float) / frame;
      fmt::print("; {:.1f} % of a frame of {:.3f} ms (wanted 10 % or less: {})", 100 * cost, frame,
                 cost <= 0.1 ? "met" : "MISSED");
    }
    fmt::print("\n");
  }
  for (const char* name : {"decide.nwa.k30", "decide.bi.k30", "decide.pbi.k30"}) {
    if (const Case* decide = find(name)) {
      fmt::print("  {:<18} {:.3f} ms\n", name, decide->counters.at("ms_per_frame"));
    }
  }
  const Case* tracer = find("rays.tracer");
  const Case* packets = find("rays.bare.packets");
  const Case* stream = find("rays.bare.stream");
  if (tracer && packets) {
    const double mine = tracer->counters.at("items_per_second");
    const double bare = packets->counters.at("items_per_second");
    fmt::print("  visibility rays: {:.1f} M/s, {:.0f} % of bare packets at {:.1f} M/s", mine / 1e6,
               100 * mine / bare, bare / 1e6);
    double most = bare;
    if (stream) {
      most = std::max(most, stream->counters.at("items_per_second"));
      fmt::print(", {:.0f} % of a bare stream at {:.1f} M/s",
                 100 * mine / stream->counters.at("items_per_second"),
                 stream->counters.at("items_per_second") / 1e6);
    }
    fmt::print(" (wanted 80 % or more: {})\n", mine >= 0.8 * most ? "met" : "MISSED");
  }
  print_light();
}

}  // namespace haarlight::bench
