// Triangles with holes: where rays pass because a texture's alpha says so.

#include "precompute/alpha_holes.h"

#include "precompute/texture.h"

namespace haarlight {

void AlphaHoles::add(const Scene& scene, const Triangle& triangle) {
  if (surface_of_material_.empty()) {
    surface_of_material_.assign(scene.material.size(), -1);
    alpha_of_texture_.resize(scene.texture.size());
  }
  std::int64_t& number = surface_of_material_[triangle.material];
  if (number < 0) {
    const Material& material = scene.material[triangle.material];
    Surface surface;
    surface.cutoff = material.alpha_cutoff;
    const auto texture = static_cast<std::size_t>(material.texture);
    if (material.texture >= 0 && texture < scene.alpha.size() && !scene.alpha[texture].empty()) {
      auto& alpha = alpha_of_texture_[texture];
      if (!alpha) alpha = std::make_shared<const std::vector<float>>(scene.alpha[texture]);
      surface.alpha = alpha;
      surface.width = scene.texture[texture].width;
      surface.height = scene.texture[texture].height;
    }
    number = static_cast<std::int64_t>(surfaces_.size());
    surfaces_.push_back(std::move(surface));
  }
  Piece piece;
  piece.surface = static_cast<std::uint32_t>(number);
  for (std::size_t c = 0; c < 3 && !scene.uv.empty(); ++c) {
    const TextureMap& map = scene.material[triangle.material].map;
    const auto [u, v] = texture_place(scene, triangle.vertex[c], map);
    piece.uv[c] = {static_cast<float>(u), static_cast<float>(v)};
  }
  pieces_.push_back(piece);
}

bool AlphaHoles::is_hole(std::size_t index, double b1, double b2) const {
  const Piece& piece = pieces_[index];
  const Surface& surface = surfaces_[piece.surface];
  if (!surface.alpha) return 1 < surface.cutoff;
  const auto mix = [&](std::size_t i) {
    return static_cast<double>(piece.uv[0][i]) * (1 - b1 - b2) +
           static_cast<double>(piece.uv[1][i]) * b1 + static_cast<double>(piece.uv[2][i]) * b2;
  };
  return sample_texture(*surface.alpha, surface.width, surface.height, mix(0), mix(1)) <
         surface.cutoff;
}

}  // namespace haarlight
