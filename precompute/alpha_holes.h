// Triangles with holes: where rays pass because a texture's alpha says so.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "precompute/scene.h"

namespace haarlight {

/// Some triangles of a scene, numbered as they were added, with copies of all that is asked of
/// them. Const use is safe from any number of threads.
class AlphaHoles {
 public:
  /// Adds a triangle of `scene`, the same scene every time.
  void add(const Scene& scene, const Triangle& triangle);

  /// Whether the place with barycentric coordinates b1, b2 (second and third corner) of triangle
  /// `index` is a hole: its alpha (1 without a texture) is below the material's cutoff.
  bool is_hole(std::size_t index, double b1, double b2) const;

 private:
  struct Surface {
    float cutoff = 0;
    int width = 0, height = 0;
    std::shared_ptr<const std::vector<float>> alpha;  // none: 1 everywhere
  };
  struct Piece {
    std::array<std::array<float, 2>, 3> uv{};
    std::uint32_t surface = 0;
  };
  std::vector<Surface> surfaces_;
  std::vector<std::int64_t> surface_of_material_;  // or -1
  std::vector<std::shared_ptr<const std::vector<float>>> alpha_of_texture_;
  std::vector<Piece> pieces_;
};

}  // namespace haarlight
