// The files that a scene is made of, and whether they are still the same.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace haarlight {

/// The scene file, and what it names: buffers and pictures of glTF and GLB, material libraries of
/// OBJ with their pictures, pictures of PLY; whether or not they are there. In order, each once.
/// Throws Error{missing} or Error{io} if the scene file itself cannot be read.
std::vector<std::filesystem::path> scene_files(const std::filesystem::path& scene);

/// XXH3, 128 bits in hexadecimal, of the names (as the scene has them) and bytes of scene_files().
/// The same wherever the files lie. A file that cannot be read counts as not there.
std::string scene_files_hash(const std::filesystem::path& scene);

/// Where the scene is as seen from the folder of `output`: what a file keeps to find it again.
std::string scene_path_from(const std::filesystem::path& scene,
                            const std::filesystem::path& output);

/// How the scene that a transport was made from stands to the one that lies beside it now.
enum class SceneState { same, changed, not_found };

/// `path` and `hash` as the transport `file` has them: the scene is looked for at `path` from the
/// folder of `file`, then under its name in that folder.
SceneState scene_state(const std::filesystem::path& file, const std::string& path,
                       const std::string& hash);

}  // namespace haarlight
