// The session with a null display: frames without a window.

#pragma once

#include <string>

#include "viewer/run_options.h"

namespace haarlight::viewer {

/// Runs options.frames frames at a sixtieth of a second each, and writes what was asked for. The
/// motion plays from the first frame on. Returns the lines that --timings prints, or nothing.
/// Throws Error.
std::string run_headless(const RunOptions& options);

}  // namespace haarlight::viewer
