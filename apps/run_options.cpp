// Options of how a precomputation runs, and what is said when it ends.

#include "apps/run_options.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "apps/option_parsers.h"
#include "core/error.h"

namespace haarlight {
namespace {

constexpr double kMaxSeconds = 1e7;

double mebibytes(std::uint64_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

Shard parse_shard(const std::string& text) {
  Shard shard;
  int end = 0;
  if (std::sscanf(text.c_str(), "%d/%d%n", &shard.index, &shard.count, &end) != 2 ||
      end != static_cast<int>(text.size()) || shard.index < 1 || shard.index > shard.count ||
      shard.count > 100'000) {
    refuse_option("--shard", text, "i/n, as 1/4 to 4/4");
  }
  return shard;
}

}  // namespace

void add_run_options(CLI::App& verb, RunOptions& options) {
  add_threads(verb)->group("Running");
  const auto size_option = [&verb](const std::string& name, std::uint64_t& target,
                                   const std::string& help) {
    verb.add_option_function<std::string>(
            name,
            [name, &target](const std::string& text) { target = parse_byte_size(name, text); },
            help)
        ->type_name("SIZE")
        ->group("Running");
  };
  size_option("--memory", options.memory,
              "most memory to use, as 800M or 4G [half of what is free]");
  size_option("--max-bytes", options.max_bytes,
              "most bytes of the file, as 200M or 1.5G; goes before --error [no limit]");
  verb.add_option_function<std::string>(
          "--time-limit",
          [&options](const std::string& text) {
            options.time_limit = parse_number("--time-limit", text, 0.1, kMaxSeconds);
          },
          "seconds for all of it; what is not traced by then is a preview [no limit]")
      ->type_name("SECONDS")
      ->group("Running");
  verb.add_option_function<std::string>(
          "--shard", [&options](const std::string& text) { options.shard = parse_shard(text); },
          "trace slice i of n only, into FILE.hlt.shard-i-of-n, for haarlight merge")
      ->type_name("i/n")
      ->group("Running");
  verb.add_flag("--resume", options.resume,
                "go on with FILE.hlt.partial (or the shard) of a run that was cut off, if it is "
                "there and fits")
      ->group("Running");
}

RunOptions watched_by(ProgressPrinter& printer, RunOptions options) {
  options.watch = [&printer](const PrecomputeStatus& status) {
    printer.set_rate(static_cast<double>(status.rays), status.seconds, "rays");
  };
  return options;
}

void print_outcome(const std::filesystem::path& output, const RunOptions& options,
                   const PrecomputeReport& report) {
  const std::string journal = journal_path(output, options.shard).string();
  if (report.bytes > 0) {
    fmt::print("{:.1f} MiB, {:.1f} million rays, {:.1f} s, measured picture error {:.3g}\n",
               mebibytes(report.bytes), static_cast<double>(report.rays) * 1e-6, report.seconds,
               report.measured_error);
    if (report.noise > 0) fmt::print("noise {:.3g} of the picture, estimated\n", report.noise);
  } else if (report.complete) {
    fmt::print("{}: all {} tiles of shard {} of {}, {:.1f} million rays, {:.1f} s\n", journal,
               report.tiles, options.shard.index, options.shard.count,
               static_cast<double>(report.rays) * 1e-6, report.seconds);
  }
  if (report.limited_by_size) {
    fmt::print("--max-bytes dropped more than --error {} asks for\n", options.error);
  }
  if (report.resumed_tiles > 0) {
    fmt::print("{} of {} tiles were there already\n", report.resumed_tiles, report.tiles);
  }
  if (report.complete) return;

  const bool kept = report.tiles_traced > 0;
  const std::string state =
      fmt::format("{:.0f} % of {} tiles traced{}",
                  std::floor(100.0 * report.tiles_traced / std::max(1, report.tiles)), report.tiles,
                  report.bytes > 0 ? ", the rest is a preview" : "");
  const std::string way_on =
      kept ? fmt::format(
                 "; the part done is kept in {}, and the same command with --resume goes "
                 "on from there",
                 journal)
           : std::string();
  if (report.end == RunEnd::time_limit) {
    fmt::print(stderr, "{}: incomplete: {}{}\n", output.string(), state, way_on);
    return;
  }
  throw Error(ErrorKind::cancelled, fmt::format("stopped: {}{}", state, way_on));
}

}  // namespace haarlight
