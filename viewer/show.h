// The session in a window.

#pragma once

#include <string>

#include "viewer/run_options.h"

namespace haarlight::viewer {

/// Opens the window and returns when it is closed. Returns the lines that --timings prints, or
/// nothing. Throws Error, in particular Error{missing} where there is no display or no OpenGL 3.3.
std::string show(const RunOptions& options, double scale);

}  // namespace haarlight::viewer
