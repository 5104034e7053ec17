// Scenes, still and moving, from any bytes.

#include <algorithm>
#include <cmath>

#include "caching/animated_scene.h"
#include "precompute/scene_files.h"
#include "precompute/scene_import.h"
#include "tests/fuzz/targets.h"

namespace haarlight::fuzz {

namespace {

void check(const Scene& scene) {
  for (const Vec3& p : scene.position) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      fault("a vertex came in that is not finite");
    }
  }
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      if (v >= scene.position.size()) fault("a triangle of a vertex that is not there");
    }
    if (t.material >= scene.material.size()) fault("a triangle of a material that is not there");
  }
}

}  // namespace

Outcome scene(Bytes bytes) {
  if (bytes.empty()) return Outcome::refused;
  constexpr const char* kNames[] = {"fuzz.glb", "fuzz.gltf", "fuzz.obj", "fuzz.ply"};
  const char* name = kNames[std::to_integer<std::size_t>(bytes[0]) % 4];
  return with_file(name, bytes.subspan(1), [](const std::filesystem::path& file) {
    scene_files_hash(file);
    check(import_scene(file));
  });
}

Outcome animation(Bytes bytes) {
  return with_file("fuzz.glb", bytes, [](const std::filesystem::path& file) {
    const AnimatedScene scene(file);
    for (const int frame : {0, std::max(scene.frames() - 1, 0), 1'000'000'000}) {
      const AnimatedFrame at = scene.at(frame);
      check(at.scene);
      if (at.scene.triangle.size() != scene.triangle_count()) fault("triangles come and go");
      if (at.emission.size() != at.scene.material.size()) fault("materials without emission");
      if (at.light.size() != scene.light_nodes().size()) fault("lights come and go");
      for (const SceneLight& light : at.light) {
        if (!is_finite(light.intensity)) fault("a light came in that is not finite");
      }
    }
    for (std::uint32_t t = 0; t < scene.triangle_count(); ++t) scene.instance_of(t);
  });
}

}  // namespace haarlight::fuzz
