// Cube maps as flat pictures, and where on them a frame's wavelets lie.

#pragma once

#include <cstdint>
#include <vector>

#include "prt/lighting_update.h"
#include "wavelet/cubemap.h"
#include "wavelet/haar.h"

namespace haarlight::viewer {

enum class Unfolding {
  latlong,  ///< 2:1, as environment files
  cross,    ///< vertical cross, 3 faces wide and 4 high
};

/// Per texel ([face][y][x]) how many of an update's wavelets lie over it. Reuses `counts`.
void count_touched(const HaarLayout& layout, const LightingUpdate& update,
                   std::vector<std::uint16_t>& counts);

/// Which texel of a cube map each pixel of a flat picture shows: worked out once, used every frame.
class UnfoldedCube {
 public:
  /// `height` in pixels; the cross rounds it down to whole faces.
  UnfoldedCube(Unfolding unfolding, int face_size, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  int face_size() const { return face_size_; }
  /// Texel of each pixel, row-major; -1 where the picture holds none.
  const std::vector<int>& texels() const { return texels_; }

 private:
  int width_, height_, face_size_;
  std::vector<int> texels_;
};

/// Display bytes (RGBA, sRGB) of a cube map under an exposure, clamped; texels that `touched`
/// counts more often than the least are drawn over in orange, up to four fifths for the most.
/// `touched` may be empty.
void draw_cubemap(const UnfoldedCube& unfolded, const Cubemap& map, double exposure_ev,
                  const std::vector<std::uint16_t>& touched, std::vector<std::uint8_t>& rgba);

}  // namespace haarlight::viewer
