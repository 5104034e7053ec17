// Options that say what of a scene is traced, and how well; the same for plan and precompute.

#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "precompute/default_stage.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene.h"

namespace haarlight {

/// A scene file and how it is looked at.
struct SceneOptions {
  enum class View { automatic, scene, framing };
  std::filesystem::path scene;
  View view = View::automatic;
  StageOptions stage;
  bool vertices = false;
  bool auto_effects = true;       ///< by the plan; else trace.effects
  std::vector<std::string> merl;  ///< MATERIAL=FILE.binary each
  int bounces = -1;               ///< that override effects'; -1: they are left
};

/// SCENE, and the options of groups Stage, Light, Accuracy and Mesh.
void add_scene_options(CLI::App& verb, SceneOptions& scene, MeshOptions& options);

/// A scene read and set up; repairs are printed if wanted. Throws what the importer does, and
/// Error{missing} if a camera is asked for that is not there.
struct StagedScene {
  Scene scene;
  Stage stage;
};
StagedScene load_scene(SceneOptions& options, bool say_repairs = true);

}  // namespace haarlight
