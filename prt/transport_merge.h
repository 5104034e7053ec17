// Joins the shards of one run.

#pragma once

#include <filesystem>
#include <span>

#include "core/progress.h"
#include "prt/transport_writer.h"

namespace haarlight {

/// Writes `file` from all shards of a run, in any order: the bytes that one run would have written.
/// Shards are left as they are. Throws Error{invalid_argument} naming the file if shards are of
/// different runs, if one is missing, given twice or has tiles still to trace; Error{missing},
/// Error{format} for a file that is not there or none; Error{io}; Error{cancelled}.
TransportSummary merge_transport(const std::filesystem::path& file,
                                 std::span<const std::filesystem::path> shards,
                                 const Progress& progress = {});

}  // namespace haarlight
