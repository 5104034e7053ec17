// Options of the caching methods of haarlight animate.

#pragma once

#include <CLI/CLI.hpp>

#include "caching/caching_method.h"

namespace haarlight {

/// Adds options for all of `options` but size, seed and temporal, which the caller sets.
void add_caching_options(CLI::App& verb, CachingOptions& options);

}  // namespace haarlight
