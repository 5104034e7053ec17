// Scenes from any bytes.

#include <cmath>

#include "precompute/scene_files.h"
#include "precompute/scene_import.h"
#include "tests/fuzz/targets.h"

namespace haarlight::fuzz {

Outcome scene(Bytes bytes) {
  if (bytes.empty()) return Outcome::refused;
  constexpr const char* kNames[] = {"fuzz.glb", "fuzz.gltf", "fuzz.obj", "fuzz.ply"};
  const char* name = kNames[std::to_integer<std::size_t>(bytes[0]) % 4];
  return with_file(name, bytes.subspan(1), [](const std::filesystem::path& file) {
    scene_files_hash(file);
    const Scene scene = import_scene(file);
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
  });
}

}  // namespace haarlight::fuzz
