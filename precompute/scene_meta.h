// What a transport file says of the scene it was made from.

#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "precompute/run_options.h"
#include "precompute/scene.h"

namespace haarlight {

/// Adds "fingerprint" to a description and, of a scene that came from a file, "scene_path" (from
/// the folder of `output`) and "scene_hash" (see precompute/scene_files.h).
void add_origin(nlohmann::json& meta, const RunOptions& options,
                const std::filesystem::path& output, const std::string& fingerprint);

/// Name, sizes and what the importer mended.
nlohmann::json scene_meta(const Scene& scene);

}  // namespace haarlight
