// The files that a scene is made of, and whether they are still the same.

#include "precompute/scene_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "core/error.h"
#include "core/json_depth.h"
#include "precompute/content_hash.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;

std::optional<std::string> bytes_of(const fs::path& file) {
  std::error_code code;
  if (!fs::is_regular_file(file, code)) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string trimmed(const std::string& text) {
  const char* blank = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(blank);
  return begin == std::string::npos ? std::string()
                                    : text.substr(begin, text.find_last_not_of(blank) - begin + 1);
}

// "a%20b" -> "a b".
std::string percent_decoded(const std::string& uri) {
  std::string out;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool coded = uri[i] == '%' && i + 2 < uri.size() &&
                       std::isxdigit(static_cast<unsigned char>(uri[i + 1])) != 0 &&
                       std::isxdigit(static_cast<unsigned char>(uri[i + 2])) != 0;
    if (coded) {
      out += static_cast<char>(std::stoi(uri.substr(i + 1, 2), nullptr, 16));
      i += 2;
    } else {
      out += uri[i];
    }
  }
  return out;
}

// The JSON of a glTF file, or of the first chunk of a GLB.
nlohmann::json gltf_json(const std::string& bytes) {
  std::string text = bytes;
  if (bytes.size() >= 20 && bytes.compare(0, 4, "glTF") == 0) {
    std::uint32_t length = 0;
    std::memcpy(&length, bytes.data() + 12, sizeof length);
    text = bytes.substr(20, length);
  }
  if (json_nests_too_deep(text)) return {};
  return nlohmann::json::parse(text, nullptr, false);
}

std::vector<std::string> named_in_gltf(const std::string& bytes) {
  std::vector<std::string> names;
  const nlohmann::json root = gltf_json(bytes);
  if (!root.is_object()) return names;
  for (const char* kind : {"buffers", "images"}) {
    if (!root.contains(kind) || !root[kind].is_array()) continue;
    for (const nlohmann::json& entry : root[kind]) {
      if (!entry.is_object() || !entry.contains("uri") || !entry["uri"].is_string()) continue;
      const std::string uri = entry["uri"].get<std::string>();
      if (uri.compare(0, 5, "data:") != 0) names.push_back(percent_decoded(uri));
    }
  }
  if (!root.contains("materials") || !root["materials"].is_array()) return names;
  for (const nlohmann::json& material : root["materials"]) {
    const nlohmann::json::json_pointer at("/extras/haarlight/measured");
    if (material.contains(at) && material.at(at).is_string()) {
      names.push_back(material.at(at).get<std::string>());
    }
  }
  return names;
}

// What stands after `keyword` in lines that begin with it, without options ("-s 1 1 1").
template <typename IsKeyword>
std::vector<std::string> named_in_lines(const std::string& text, const IsKeyword& is_keyword) {
  std::vector<std::string> names;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    line = trimmed(line);
    const std::size_t end = line.find_first_of(" \t");
    if (end == std::string::npos || !is_keyword(lower(line.substr(0, end)))) continue;
    std::string rest = trimmed(line.substr(end));
    // Names may hold blanks; with options before it, the name is the last word.
    if (rest.front() == '-') rest = rest.substr(rest.find_last_of(" \t") + 1);
    std::replace(rest.begin(), rest.end(), '\\', '/');
    if (!rest.empty()) names.push_back(rest);
  }
  return names;
}

std::vector<std::string> named_in_obj(const std::string& text) {
  return named_in_lines(text, [](const std::string& word) { return word == "mtllib"; });
}

std::vector<std::string> named_in_mtl(const std::string& text) {
  return named_in_lines(text, [](const std::string& word) {
    return word.compare(0, 4, "map_") == 0 || word == "bump" || word == "disp" || word == "decal" ||
           word == "norm" || word == "refl";
  });
}

std::vector<std::string> named_in_ply(const std::string& bytes) {
  std::istringstream stream(bytes.substr(0, bytes.find("end_header")));
  std::vector<std::string> names;
  for (std::string line; std::getline(stream, line);) {
    const std::string start = "comment TextureFile ";
    if (line.compare(0, start.size(), start) == 0)
      names.push_back(trimmed(line.substr(start.size())));
  }
  return names;
}

std::vector<std::string> named_in(const fs::path& file, const std::string& bytes) {
  const std::string suffix = lower(file.extension().string());
  if (suffix == ".gltf" || suffix == ".glb") return named_in_gltf(bytes);
  if (suffix == ".obj") return named_in_obj(bytes);
  if (suffix == ".mtl") return named_in_mtl(bytes);
  if (suffix == ".ply") return named_in_ply(bytes);
  return {};
}

struct NamedFile {
  std::string name;  // as it is written in the file that names it
  fs::path path;
};

// Breadth first, each path once.
std::vector<NamedFile> collect(const fs::path& scene) {
  std::vector<NamedFile> files{{"", scene}};
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::optional<std::string> bytes = bytes_of(files[i].path);
    if (i == 0 && !bytes) {
      std::error_code code;
      const bool there = fs::exists(scene, code);
      throw Error(there ? ErrorKind::io : ErrorKind::missing,
                  fmt::format("{}: {}, expected a scene", scene.string(),
                              there ? "cannot be read" : "no such file"));
    }
    if (!bytes) continue;
    for (const std::string& name : named_in(files[i].path, *bytes)) {
      const fs::path path = scene.parent_path() / name;
      const bool known = std::any_of(files.begin(), files.end(),
                                     [&](const NamedFile& f) { return f.path == path; });
      if (!known) files.push_back({name, path});
    }
  }
  return files;
}

}  // namespace

std::vector<fs::path> scene_files(const fs::path& scene) {
  std::vector<fs::path> paths;
  for (const NamedFile& file : collect(scene)) paths.push_back(file.path);
  return paths;
}

std::string scene_files_hash(const fs::path& scene) {
  ContentHash hash;
  for (const NamedFile& file : collect(scene)) {
    const std::optional<std::string> bytes = bytes_of(file.path);
    hash.add(file.name);
    hash.add(bytes.has_value());
    if (bytes) hash.add(*bytes);
  }
  return hash.text();
}

std::string scene_path_from(const fs::path& scene, const fs::path& output) {
  std::error_code code;
  const fs::path folder = fs::weakly_canonical(fs::absolute(output, code), code).parent_path();
  const fs::path here = fs::weakly_canonical(fs::absolute(scene, code), code);
  const fs::path relative = here.lexically_relative(folder);
  return (relative.empty() ? here : relative).generic_string();
}

SceneState scene_state(const fs::path& file, const std::string& path, const std::string& hash) {
  const fs::path folder = file.parent_path();
  bool found = false;
  for (const fs::path& place : {folder / path, folder / fs::path(path).filename()}) {
    std::error_code code;
    if (!fs::is_regular_file(place, code)) continue;
    found = true;
    try {
      if (scene_files_hash(place) == hash) return SceneState::same;
    } catch (const Error&) {
      continue;  // gone or closed since
    }
  }
  return found ? SceneState::changed : SceneState::not_found;
}

}  // namespace haarlight
