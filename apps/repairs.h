// Tells the user once what was mended in what came in.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "precompute/scene.h"
#include "wavelet/environment.h"

namespace haarlight {

/// A line on standard error for each kind of repair; nothing for a clean input.
void print_repairs(const std::filesystem::path& file, const EnvironmentReport& report);
void print_repairs(const std::filesystem::path& file, const SceneReport& report);
/// A line for each note on what will be black.
void print_notes(const std::filesystem::path& file, const std::vector<std::string>& notes);

}  // namespace haarlight
