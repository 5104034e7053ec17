// Preferences to and from JSON.

#include "viewer/preferences.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/atomic_file.h"

namespace haarlight::viewer {

std::filesystem::path preferences_file() {
  const auto below = [](const char* variable) -> std::filesystem::path {
    const char* value = std::getenv(variable);
    return value ? value : "";
  };
  std::filesystem::path folder = below("XDG_CONFIG_HOME");
  if (!folder.is_absolute()) {
    folder = below("HOME");
    if (!folder.is_absolute()) return {};
    folder /= ".config";
  }
  return folder / "haarlight" / "viewer.json";
}

Preferences load_preferences(const std::filesystem::path& file) {
  Preferences p;
  try {
    std::ifstream stream(file);
    if (!stream) return p;
    const nlohmann::json json = nlohmann::json::parse(stream);
    p.width = std::clamp(json.value("width", p.width), 320, 16384);
    p.height = std::clamp(json.value("height", p.height), 240, 16384);
    p.panels = json.value("panels", p.panels);
    p.plots = json.value("plots", p.plots);
    p.curve = json.value("tonemap", p.curve);
    p.transport = json.value("transport", std::string());
    p.env = json.value("env", std::string());
    p.folder = json.value("folder", std::string());
  } catch (const nlohmann::json::exception&) {
    return {};
  }
  return p;
}

void save_preferences(const std::filesystem::path& file, const Preferences& p) {
  const nlohmann::json json = {{"width", p.width},      {"height", p.height},
                               {"panels", p.panels},    {"plots", p.plots},
                               {"tonemap", p.curve},    {"transport", p.transport.string()},
                               {"env", p.env.string()}, {"folder", p.folder.string()}};
  std::error_code error;  // the file says it better
  std::filesystem::create_directories(file.parent_path(), error);
  const std::string text = json.dump(2) + "\n";
  AtomicFile out(file);
  out.write(text.data(), text.size());
  out.commit();
}

}  // namespace haarlight::viewer
