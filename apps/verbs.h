// The verbs of the program. Each adds itself to the command line; its work runs when main asks.

#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace haarlight {

/// Thrown by a process whose failure another one reports: the program ends with exit code 1 and
/// says nothing.
struct SilentFailure {};

/// The work of a verb, its options parsed: throws Error, or CLI::ValidationError where options
/// contradict each other.
using Verb = std::function<void()>;

Verb add_plan(CLI::App& verb);
Verb add_precompute(CLI::App& verb);
Verb add_compress(CLI::App& verb);
Verb add_relight(CLI::App& verb);
Verb add_compare(CLI::App& verb);
Verb add_info(CLI::App& verb);
Verb add_merge(CLI::App& verb);
Verb add_animate(CLI::App& verb);

}  // namespace haarlight
