// The driver: pilots, thresholds, every tile traced and compressed, one file.

#pragma once

#include <filesystem>
#include <string>

#include "core/progress.h"
#include "precompute/run_options.h"
#include "precompute/tile_source.h"
#include "prt/transport.h"

namespace haarlight {

/// What a run makes.
struct TileRun {
  TransportInfo info;       ///< without meta
  std::string fingerprint;  ///< of all that the rows depend on, RunOptions too
  std::string meta;         ///< JSON object: what the file shall say of itself; a function of the
                            ///< input, so that equal runs give equal bytes
};

/// Makes `file` from the tiles of `source`:
///   pilot tiles -> thresholds -> every tile traced, transformed, compressed -> file
/// on all threads of core/parallel.h; the same bytes on any number of them, and whether or not a
/// run was cut off and resumed. Throws as precompute_image() does.
PrecomputeReport run_tiles(const TileSource& source, const TileRun& run, const RunOptions& options,
                           const std::filesystem::path& file, const Progress& progress);

}  // namespace haarlight
