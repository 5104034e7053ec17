// Unfolds cube maps.

#include "viewer/lighting_picture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "wavelet/projection.h"

namespace haarlight::viewer {
namespace {

/// Display byte of a linear value in [0, 1], by table: fine enough that no byte is skipped where
/// the curve is steepest (12.92 * 255 / 4096 < 1).
std::uint8_t display_byte(float value) {
  static const std::array<std::uint8_t, 4097> table = [] {
    std::array<std::uint8_t, 4097> out{};
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double x = static_cast<double>(i) / 4096;
      const double y = x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
      out[i] = static_cast<std::uint8_t>(std::lround(255 * y));
    }
    return out;
  }();
  return table[static_cast<std::size_t>(std::clamp(value, 0.0f, 1.0f) * 4096)];
}

std::uint8_t mix(std::uint8_t a, int b, double share) {
  return static_cast<std::uint8_t>(std::lround(a + share * (b - a)));
}

}  // namespace

void count_touched(const HaarLayout& layout, const LightingUpdate& update,
                   std::vector<std::uint16_t>& counts) {
  const int n = layout.face_size();
  counts.assign(static_cast<std::size_t>(layout.size()), 0);
  for (const WaveletDelta& delta : update.deltas) {
    // Scaling functions: one a face. Level l: 3 orientations of 2^l x 2^l wavelets a face.
    int face = delta.index, x = 0, y = 0, side = 1;
    if (delta.index >= 6) {
      const int level = (std::bit_width(static_cast<unsigned>(delta.index / 6)) - 1) / 2;
      side = 1 << level;
      const int rest = delta.index - 6 * side * side;
      face = rest / (3 * side * side);
      y = rest % (side * side) / side;
      x = rest % side;
    }
    const int size = n / side;
    for (int j = y * size; j < (y + 1) * size; ++j) {
      for (int i = x * size; i < (x + 1) * size; ++i) {
        std::uint16_t& count = counts[cube_index(face, i, j, n)];
        if (count < 0xffff) ++count;
      }
    }
  }
}

UnfoldedCube::UnfoldedCube(Unfolding unfolding, int face_size, int height) : face_size_(face_size) {
  const bool cross = unfolding == Unfolding::cross;
  const int face_pixels = std::max(1, height / 4);
  width_ = cross ? 3 * face_pixels : 2 * height;
  height_ = cross ? 4 * face_pixels : height;
  texels_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  const Projection projection = cross ? Projection::vertical_cross : Projection::latlong;
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const auto direction =
          projection_direction(projection, (x + 0.5) / width_, (y + 0.5) / height_);
      if (!direction) {
        texels_.push_back(-1);
        continue;
      }
      const CubePoint at = cube_point(*direction);
      texels_.push_back(static_cast<int>(cube_index(at.face, cube_texel(at.u, face_size),
                                                    cube_texel(at.v, face_size), face_size)));
    }
  }
}

void draw_cubemap(const UnfoldedCube& unfolded, const Cubemap& map, double exposure_ev,
                  const std::vector<std::uint16_t>& touched, std::vector<std::uint8_t>& rgba) {
  const auto factor = static_cast<float>(std::exp2(exposure_ev));
  const std::vector<int>& texels = unfolded.texels();
  rgba.resize(4 * texels.size());
  // Coarse wavelets lie over everything and say nothing: the least count is the ground.
  int least = 0, range = 1;
  if (!touched.empty()) {
    const auto [low, high] = std::minmax_element(touched.begin(), touched.end());
    least = *low;
    range = std::max(1, *high - *low);
  }
  for (std::size_t i = 0; i < texels.size(); ++i) {
    std::uint8_t* out = &rgba[4 * i];
    if (texels[i] < 0) {
      std::fill(out, out + 4, std::uint8_t{0});
      continue;
    }
    const auto t = static_cast<std::size_t>(texels[i]);
    out[0] = display_byte(map.texels[t].r * factor);
    out[1] = display_byte(map.texels[t].g * factor);
    out[2] = display_byte(map.texels[t].b * factor);
    out[3] = 255;
    if (!touched.empty() && touched[t] > least) {
      const double share = 0.8 * (touched[t] - least) / range;
      out[0] = mix(out[0], 255, share);
      out[1] = mix(out[1], 140, share);
      out[2] = mix(out[2], 30, share);
    }
  }
}

}  // namespace haarlight::viewer
