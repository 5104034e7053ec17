// What a scene's materials are, by area.

#include "precompute/scene_facts.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "precompute/bsdf.h"
#include "precompute/surface.h"

namespace haarlight {
namespace {

bool is_colored(const RgbD& c) {
  const double most = std::max({c.r, c.g, c.b}), least = std::min({c.r, c.g, c.b});
  return most - least > 0.01 * most;
}

RgbD mean_of(const Image& image, std::size_t step) {
  RgbD sum;
  double count = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += step) sum += RgbD(image.pixels[i]), ++count;
  return count > 0 ? sum * (1 / count) : RgbD{1, 1, 1};
}

bool any_colored(const Image& image) {
  return std::any_of(image.pixels.begin(), image.pixels.end(),
                     [](const Rgb& p) { return is_colored(RgbD(p)); });
}

}  // namespace

SceneFacts scene_facts(const Scene& scene) {
  SceneFacts facts;
  std::vector<double> area(scene.material.size(), 0.0);
  double all = 0;
  bool tinted = false;
  for (const Triangle& t : scene.triangle) {
    const Vec3& a = scene.position[t.vertex[0]];
    const double size =
        length(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a));
    area[t.material] += size;
    all += size;
  }
  for (const Rgb& t : scene.tint) tinted = tinted || is_colored(RgbD(t));

  double narrowest = 1e9, widest_table = 0;
  for (std::size_t m = 0; m < scene.material.size(); ++m) {
    if (!(area[m] > 0)) continue;
    const Material& material = scene.material[m];
    const double share = area[m] / all;
    SurfaceHit hit;
    hit.geometric_normal = hit.normal = {0, 1, 0};
    hit.to_viewer = normalize(Vec3{0, 1, 1});
    hit.material = static_cast<std::uint32_t>(m);
    hit.albedo = material.albedo;
    hit.metallic = material.metallic;
    hit.roughness = material.roughness;
    if (material.texture >= 0) {
      const Image& image = scene.texture[static_cast<std::size_t>(material.texture)];
      hit.albedo = hit.albedo * Rgb(mean_of(image, 7));
      facts.colored = facts.colored || any_colored(image);
    }
    const Bsdf b = bsdf_at(scene, hit);
    RgbD reflected = b.diffuse_albedo() + b.lobe_albedo();
    double single = 0;
    for (int i = 0; i < b.delta_count; ++i) {
      const Bsdf::Delta& delta = b.delta[static_cast<std::size_t>(i)];
      single += luminance(delta.weight);
      reflected += delta.weight;
      facts.has_glass = facts.has_glass || delta.transmitted;
    }
    facts.mean_albedo += share * std::min(1.0, luminance(reflected));
    facts.reflects = facts.reflects || luminance(reflected) > 1e-3;
    facts.colored = facts.colored || is_colored(reflected) || is_colored(b.diffuse_reflectance) ||
                    is_colored(b.gloss_first) || l1_norm(material.extinction) > 0;
    if (b.has_lobe()) {
      facts.glossy_area += share;
      if (b.lobe_half_width() < narrowest) {
        narrowest = b.lobe_half_width();
        facts.glossiest = static_cast<int>(m);
      }
    }
    if (material.measured) {
      facts.measured_area += share;
      if (share > widest_table) widest_table = share, facts.measured = static_cast<int>(m);
    }
    if (single > 0 || has_single_directions(material)) facts.specular_area += share;
  }
  facts.colored = facts.colored || (tinted && facts.reflects);
  return facts;
}

}  // namespace haarlight
