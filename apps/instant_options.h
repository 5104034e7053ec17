// Options of haarlight animate for pictures by virtual lights.

#pragma once

#include <CLI/CLI.hpp>

#include "caching/instant_method.h"

namespace haarlight {

/// Adds options for all of `options` but size and kind, which the caller sets.
void add_instant_options(CLI::App& verb, InstantOptions& options);

}  // namespace haarlight
