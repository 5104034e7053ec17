// What is remembered from one run to the next.

#pragma once

#include <filesystem>
#include <string>

namespace haarlight::viewer {

struct Preferences {
  int width = 1280, height = 800;  ///< of the window
  bool panels = true, plots = true;
  std::string curve = "filmic";
  std::filesystem::path transport, env;  ///< opened last; empty: none
  std::filesystem::path folder;          ///< of the file dialog
};

/// $XDG_CONFIG_HOME/haarlight/viewer.json, or below ~/.config; empty where neither is known.
std::filesystem::path preferences_file();

/// Reads them; what is missing or makes no sense is as in a first run. Never throws.
Preferences load_preferences(const std::filesystem::path& file);

/// Writes them, making the folder. Throws Error{io}.
void save_preferences(const std::filesystem::path& file, const Preferences& preferences);

}  // namespace haarlight::viewer
