// What is refused before minutes of work: options outside their range, a file without a place.

#pragma once

#include <filesystem>

#include "core/camera.h"
#include "precompute/run_options.h"

namespace haarlight {

/// Each throws Error{invalid_argument} naming the option, its value and what was wanted.
void check(const RunOptions& options);
void check(const Camera& camera);

/// Throws Error{io} unless `file` can be written.
void check_output(const std::filesystem::path& file);

}  // namespace haarlight
