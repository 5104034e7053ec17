// What makes a picture black though all is well.

#include "precompute/scene_notes.h"

#include <algorithm>
#include <cstdint>

#include "precompute/scene_facts.h"

namespace haarlight {
namespace {

bool all_black(const Scene& scene) {
  constexpr float kBlack = 1e-3f;
  const SceneFacts facts = scene_facts(scene);
  if (!facts.reflects) return true;
  // Vertex colours dim what is diffuse; lobes, mirrors and glass are not asked about.
  return !scene.tint.empty() && facts.glossy_area == 0 && facts.specular_area == 0 &&
         std::all_of(scene.tint.begin(), scene.tint.end(), [](const Rgb& t) {
           return std::max({t.r, t.g, t.b}) <= kBlack;
         });
}

bool shows(const Visibility& visibility, const Camera& camera) {
  const Vec3 eye = visibility.to_local(camera.position);
  const auto width = static_cast<std::uint64_t>(camera.width);
  const std::uint64_t pixels = width * static_cast<std::uint64_t>(camera.height);
  // Strides over the picture first, so that few rays do for most: a prime that does not divide the
  // number of pixels meets each of them once.
  std::uint64_t step = 1;
  for (const std::uint64_t prime : {1009u, 1013u, 1019u, 1021u, 1031u, 1033u}) {
    if (pixels % prime != 0) {
      step = prime;
      break;
    }
  }
  for (std::uint64_t i = 0, at = 0; i < pixels; ++i, at = (at + step) % pixels) {
    const Vec3 direction = camera.direction(static_cast<double>(at % width) + 0.5,
                                            static_cast<double>(at / width) + 0.5);
    if (visibility.first_hit(eye, direction)) return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> scene_notes(const Scene& scene, const Visibility& visibility,
                                     const Camera* camera) {
  std::vector<std::string> notes;
  if (all_black(scene)) notes.emplace_back("all materials are black");
  if (camera && !shows(visibility, *camera)) {
    notes.emplace_back("nothing of the scene is in the picture");
  }
  return notes;
}

}  // namespace haarlight
