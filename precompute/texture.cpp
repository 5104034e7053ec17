// Looking up textures between their pixels.

#include "precompute/texture.h"

#include <cmath>
#include <cstddef>

namespace haarlight {
namespace {

// Pixels around a place and its shares between them.
struct Place {
  std::size_t left_top, right_top, left_bottom, right_bottom;
  float x, y;  // how far from left to right, from top to bottom

  Place(int width, int height, double u, double v) {
    if (!std::isfinite(u) || !std::isfinite(v)) u = v = 0;
    const double across = (u - std::floor(u)) * width - 0.5;
    const double down = (1 - (v - std::floor(v))) * height - 0.5;
    const double x0 = std::floor(across), y0 = std::floor(down);
    const auto wrap = [](double i, int size) {
      const int k = static_cast<int>(i) % size;
      return static_cast<std::size_t>(k < 0 ? k + size : k);
    };
    const std::size_t left = wrap(x0, width), right = wrap(x0 + 1, width);
    const auto row = static_cast<std::size_t>(width);
    const std::size_t top = wrap(y0, height) * row, bottom = wrap(y0 + 1, height) * row;
    left_top = top + left, right_top = top + right;
    left_bottom = bottom + left, right_bottom = bottom + right;
    x = static_cast<float>(across - x0), y = static_cast<float>(down - y0);
  }

  template <typename T>
  T mix(const std::vector<T>& pixels) const {
    const T upper = pixels[left_top] * (1 - x) + pixels[right_top] * x;
    const T lower = pixels[left_bottom] * (1 - x) + pixels[right_bottom] * x;
    return upper * (1 - y) + lower * y;
  }
};

}  // namespace

Rgb sample_texture(const Image& texture, double u, double v) {
  return Place(texture.width, texture.height, u, v).mix(texture.pixels);
}

float sample_texture(const std::vector<float>& values, int width, int height, double u, double v) {
  return Place(width, height, u, v).mix(values);
}

std::array<double, 2> texture_place(const Scene& scene, std::uint32_t vertex,
                                    const TextureMap& map) {
  const auto& all = map.second ? scene.uv2 : scene.uv;
  const std::array<float, 2> uv = vertex < all.size() ? all[vertex] : std::array<float, 2>{};
  const auto row = [&](std::size_t i) {
    const float* m = map.matrix.data() + 3 * i;
    return static_cast<double>(m[0]) * static_cast<double>(uv[0]) +
           static_cast<double>(m[1]) * static_cast<double>(uv[1]) + static_cast<double>(m[2]);
  };
  return {row(0), row(1)};
}

}  // namespace haarlight
