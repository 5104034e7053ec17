// What a transport file says of how, and of which scene, it was made.

#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "precompute/precompute.h"
#include "precompute/scene.h"

namespace haarlight {

/// The description that pictures and meshes share: generator, scene (name, sizes and what the
/// importer mended), options, effects, plan if there is one, "fingerprint" and, of a scene that
/// came from a file, "scene_path" (from the folder of `output`) and "scene_hash" (see
/// precompute/scene_files.h).
nlohmann::json run_meta(const Scene& scene, const PrecomputeOptions& options,
                        const std::filesystem::path& output, const std::string& fingerprint);

/// As text of one line; names that are not UTF-8 are mended.
std::string meta_text(const nlohmann::json& meta);

}  // namespace haarlight
