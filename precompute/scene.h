// A scene in memory: triangles, materials, a camera. What importers make and precomputation reads.

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// f_r = albedo / pi + specular (e + 2) / (2 pi) max(0, cos alpha)^e, alpha the angle between the
/// light and the mirror direction of the view: Lambert plus one Phong lobe, normalised so that
/// `specular` is the lobe's reflectance at normal incidence.
struct Material {
  std::string name;
  Rgb albedo{0.5f, 0.5f, 0.5f};  ///< linear, [0, 1]; multiplied by the texture if there is one
  int texture = -1;              ///< index into Scene::textures, or none
  Rgb specular{0, 0, 0};         ///< linear, [0, 1]
  float exponent = 32;           ///< Phong e, >= 0
};

struct Triangle {
  std::array<std::uint32_t, 3> vertex{};
  std::uint32_t material = 0;
};

/// What the importer mended; printed by programs, tested by tests.
struct SceneReport {
  std::int64_t dropped_degenerate = 0;    ///< zero-area or with repeated corners
  std::int64_t dropped_not_finite = 0;    ///< with a NaN or infinite corner
  std::int64_t dropped_duplicate = 0;     ///< same three corners as an earlier one
  std::int64_t dropped_not_triangle = 0;  ///< points and lines
  std::int64_t normals_made = 0;          ///< vertices whose normal was missing, zero or not finite
  std::int64_t unused_vertices = 0;       ///< that no triangle used: removed
  std::int64_t textures_missing = 0;  ///< named by the file, not there: the plain colour is used
};

struct Scene {
  std::string name;                      ///< for messages and files: the imported file's name
  std::vector<Vec3> position;            ///< world space, metres
  std::vector<Vec3> normal;              ///< unit, one a vertex
  std::vector<std::array<float, 2>> uv;  ///< one a vertex, v up; (0, 0) where there is none
  std::vector<Rgb> tint;  ///< one a vertex, linear, multiplies the albedo; empty: all white
  std::vector<Triangle> triangle;
  std::vector<Material> material;  ///< at least one
  std::vector<Image> texture;      ///< linear base colour, repeating
  std::optional<Camera> camera;    ///< of the file, if it has one
  SceneReport report;
};

}  // namespace haarlight
