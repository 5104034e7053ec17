// A texture of OpenGL.

#pragma once

#include <cstdint>
#include <span>

#include "core/image.h"

namespace haarlight::viewer {

/// Owns one 2D texture of the context that was current when it was first filled. Filling it again
/// at the same size makes no new one.
class Texture {
 public:
  Texture() = default;
  ~Texture();
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;

  void fill(const Image& picture);                                  ///< three floats
  void fill(int width, int height, std::span<const float> values);  ///< one float
  void fill_rgba(int width, int height, std::span<const std::uint8_t> bytes);
  /// Around the left and right border, as a lat-long picture goes on.
  void wrap_around();

  unsigned id() const { return id_; }
  bool empty() const { return id_ == 0; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  void fill_any(int width, int height, int internal, unsigned format, unsigned type,
                const void* data);
  unsigned id_ = 0;
  int width_ = 0, height_ = 0;
};

}  // namespace haarlight::viewer
