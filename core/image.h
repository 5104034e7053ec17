// A picture in memory.

#pragma once

#include <cstddef>
#include <vector>

#include "core/rgb.h"

namespace haarlight {

/// Linear RGB pixels, row-major from the top left: pixel (x, y) is pixels[y * width + x].
struct Image {
  int width = 0, height = 0;
  std::vector<Rgb> pixels;  ///< width * height

  Image() = default;
  Image(int w, int h)
      : width(w), height(h), pixels(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  Rgb& at(int x, int y) { return pixels[index(x, y)]; }
  const Rgb& at(int x, int y) const { return pixels[index(x, y)]; }
};

}  // namespace haarlight
