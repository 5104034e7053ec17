// What rows depend on, hashed.

#include "precompute/fingerprint.h"

#include "precompute/measured_brdf.h"

namespace haarlight {
namespace {

void add_material(ContentHash& hash, const Material& m) {
  hash.add(static_cast<int>(m.model)), hash.add(m.albedo), hash.add(m.texture);
  hash.add(m.specular), hash.add(m.exponent);
  hash.add(m.metallic), hash.add(m.roughness), hash.add(m.metallic_roughness_texture);
  hash.add(m.transmission);
  hash.add(m.ior), hash.add(m.extinction), hash.add(m.thin);
  hash.add(m.measured != nullptr);
  if (m.measured) {
    hash.add(m.measured->half_cells), hash.add(m.measured->difference_cells);
    hash.add_all(m.measured->value);
  }
  hash.add(m.normal_texture), hash.add(m.normal_scale), hash.add(m.alpha_cutoff);
  for (const TextureMap& map : {m.map, m.metallic_roughness_map, m.normal_map}) {
    hash.add(map.second);
    for (const float x : map.matrix) hash.add(x);
  }
}

}  // namespace

void add_scene(ContentHash& hash, const Scene& scene) {
  hash.add_all(scene.position);
  hash.add_all(scene.normal);
  hash.add_all(scene.uv);
  hash.add_all(scene.uv2);
  hash.add_all(scene.tint);
  hash.add(scene.triangle.size());
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) hash.add(v);
    hash.add(t.material);
  }
  hash.add(scene.material.size());
  for (const Material& m : scene.material) add_material(hash, m);
  hash.add_all(scene.texture);
  hash.add(scene.alpha.size());
  for (const std::vector<float>& alpha : scene.alpha) hash.add_all(alpha);
}

void add_camera(ContentHash& hash, const Camera& camera) {
  hash.add(camera.position);
  for (const Vec3& row : camera.orientation.row) hash.add(row);
  hash.add(camera.vertical_fov), hash.add(camera.width), hash.add(camera.height);
}

void add_options(ContentHash& hash, const TraceOptions& options) {
  hash.add(options.face_size), hash.add(options.spp), hash.add(options.adaptive);
  hash.add(options.pixel_samples);
  const Effects& e = options.effects;
  hash.add(e.shadows), hash.add(e.bounces), hash.add(e.gloss), hash.add(e.specular);
  hash.add(e.caustics), hash.add(e.color);
  hash.add(options.indirect_face), hash.add(options.noise), hash.add(options.paths),
      hash.add(options.seed);
}

void add_options(ContentHash& hash, const RunOptions& options) {
  hash.add(options.error), hash.add(options.max_bytes);
}

}  // namespace haarlight
