// Options of how a precomputation runs, and what is said when it ends.

#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "apps/progress_printer.h"
#include "precompute/run_options.h"

namespace haarlight {

/// --threads, --memory, --time-limit, --max-bytes, --shard, --resume.
void add_run_options(CLI::App& verb, RunOptions& options);

/// Options for `output` of a run that `printer` shows.
RunOptions watched_by(ProgressPrinter& printer, RunOptions options);

/// Prints what became of the run: sizes and errors on standard output, on standard error what is
/// incomplete and how to go on. Throws Error{cancelled} for a run that was stopped.
void print_outcome(const std::filesystem::path& output, const RunOptions& options,
                   const PrecomputeReport& report);

}  // namespace haarlight
