// Looking up textures between their pixels.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/rgb.h"
#include "precompute/scene.h"

namespace haarlight {

/// A texture's colour at (u, v), v up, repeating, bilinear between the middles of its pixels.
Rgb sample_texture(const Image& texture, double u, double v);

/// The same for one value a pixel, row-major from the top left, `width` * `height` of them.
float sample_texture(const std::vector<float>& values, int width, int height, double u, double v);

/// (u, v) of a vertex on a texture that lies as `map` says; of none where there are no coordinates.
std::array<double, 2> texture_place(const Scene& scene, std::uint32_t vertex,
                                    const TextureMap& map);

}  // namespace haarlight
