// A scene in memory: triangles, materials, a camera. What importers make and precomputation reads.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

struct MeasuredBrdf;  // precompute/measured_brdf.h

/// How a surface reflects; all are two-sided.
enum class SurfaceModel {
  phong,               ///< Lambert plus one Phong lobe
  metallic_roughness,  ///< glTF 2.0: Lambert under a GGX lobe, see precompute/bsdf.h
  mirror,              ///< perfect reflection of share `albedo`
  glass,               ///< smooth dielectric: Fresnel reflection and refraction
  measured             ///< a table; see Material::measured
};

/// How a texture lies on a surface: its (u, v) are the rows of `matrix` times (u, v, 1), u and v of
/// a vertex' first or second coordinates.
struct TextureMap {
  bool second = false;
  std::array<float, 6> matrix{1, 0, 0, 0, 1, 0};
  bool operator==(const TextureMap&) const = default;
};

/// phong: f_r = albedo / pi + specular (e + 2) / (2 pi) max(0, cos alpha)^e, alpha the angle
/// between the light and the mirror direction of the view, so that `specular` is the lobe's
/// reflectance at normal incidence.
struct Material {
  std::string name;
  SurfaceModel model = SurfaceModel::phong;
  Rgb albedo{0.5f, 0.5f, 0.5f};  ///< linear, [0, 1]; times the base texture if there is one. phong:
                                 ///< diffuse reflectance; metallic_roughness: base colour; mirror:
                                 ///< reflectance; glass: what passes a surface besides Fresnel
  int texture = -1;              ///< base colour: index into Scene::texture, or none
  TextureMap map;                ///< of it
  // phong
  Rgb specular{0, 0, 0};  ///< linear, [0, 1]
  float exponent = 32;    ///< Phong e, >= 0
  // metallic_roughness
  float metallic = 0;                   ///< [0, 1]; times blue of its texture
  float roughness = 1;                  ///< perceptual, [0, 1]; times green of its texture
  int metallic_roughness_texture = -1;  ///< index into Scene::texture (linear values), or none
  TextureMap metallic_roughness_map;    ///< of it
  float transmission = 0;  ///< [0, 1]: share of the diffuse part that passes straight through a
                           ///< thin wall instead (KHR_materials_transmission without volume)
  // measured
  std::shared_ptr<const MeasuredBrdf> measured;  ///< else null. Per vertex, its factors are shown;
                                                 ///< elsewhere it is Lambert of the same albedo
  // metallic_roughness and glass
  float ior = 1.5f;   ///< index of refraction, >= 1
  Rgb extinction{};   ///< glass: 1/m inside; light is weakened by exp(-extinction distance)
  bool thin = false;  ///< glass: a pane without inside: passes straight, both surfaces at once
  // all
  int normal_texture = -1;  ///< tangent-space normals as in glTF (linear values), or none
  TextureMap normal_map;    ///< of it
  float normal_scale = 1;   ///< of their x and y
  float alpha_cutoff = 0;   ///< above 0: holes where the base texture's alpha is below it
};

struct Triangle {
  std::array<std::uint32_t, 3> vertex{};
  std::uint32_t material = 0;
};

/// What the importer mended; printed by programs, tested by tests.
struct SceneReport {
  std::int64_t dropped_degenerate = 0;    ///< zero-area or with repeated corners
  std::int64_t dropped_not_finite = 0;    ///< with a corner that is NaN or beyond 1e37
  std::int64_t dropped_duplicate = 0;     ///< same three corners as an earlier one
  std::int64_t dropped_out_of_range = 0;  ///< that name a vertex that is not there; glTF alone,
                                          ///< other files are refused
  std::int64_t dropped_not_triangle = 0;  ///< points and lines
  std::int64_t against_normals = 0;  ///< triangles that all their normals say face the other way:
                                     ///< left so, the normals decide which side is lit
  std::int64_t tiny = 0;             ///< triangles below 1e-7 of the scene's size: kept, but single
                                     ///< precision cannot tell their corners apart
  std::int64_t normals_made = 0;     ///< vertices whose normal was missing, zero or not finite
  std::int64_t unused_vertices = 0;  ///< that no triangle used: removed
  std::int64_t textures_missing = 0;   ///< named by the file, not there: the plain colour is used
  std::int64_t blended_materials = 0;  ///< alpha blending: taken as holes below one half
  std::int64_t rough_glass = 0;        ///< transmission with roughness: passes as through smooth
  std::int64_t measured_textures = 0;  ///< base colour textures of materials that became measured
  std::int64_t energy_scaled = 0;      ///< materials that reflected more than all: scaled to all
};

struct Scene {
  std::string name;                       ///< for messages and files: the imported file's name
  std::vector<Vec3> position;             ///< world space, metres
  std::vector<Vec3> normal;               ///< unit, one a vertex
  std::vector<std::array<float, 2>> uv;   ///< one a vertex, v up; (0, 0) where there is none
  std::vector<std::array<float, 2>> uv2;  ///< second ones, likewise; empty: none anywhere
  std::vector<Rgb> tint;  ///< one a vertex, linear, multiplies the albedo; empty: all white
  std::vector<Triangle> triangle;
  std::vector<Material> material;         ///< at least one
  std::vector<Image> texture;             ///< linear, repeating
  std::vector<std::vector<float>> alpha;  ///< one a texture, as many as pixels; empty: all 1
  std::optional<Camera> camera;           ///< of the file, if it has one
  SceneReport report;
};

}  // namespace haarlight
