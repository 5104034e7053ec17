// Fills textures.

#include "viewer/texture.h"

#include <epoxy/gl.h>

namespace haarlight::viewer {

Texture::~Texture() {
  if (id_ != 0) glDeleteTextures(1, &id_);
}

void Texture::fill_any(int width, int height, int internal, unsigned format, unsigned type,
                       const void* data) {
  if (id_ == 0) {
    glGenTextures(1, &id_);
    glBindTexture(GL_TEXTURE_2D, id_);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  }
  glBindTexture(GL_TEXTURE_2D, id_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  if (width != width_ || height != height_) {
    glTexImage2D(GL_TEXTURE_2D, 0, internal, width, height, 0, format, type, data);
    width_ = width;
    height_ = height;
  } else {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width, height, format, type, data);
  }
}

void Texture::fill(const Image& picture) {
  fill_any(picture.width, picture.height, GL_RGB32F, GL_RGB, GL_FLOAT, picture.pixels.data());
}

void Texture::fill(int width, int height, std::span<const float> values) {
  fill_any(width, height, GL_R32F, GL_RED, GL_FLOAT, values.data());
}

void Texture::fill_rgba(int width, int height, std::span<const std::uint8_t> bytes) {
  fill_any(width, height, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, bytes.data());
}

void Texture::wrap_around() {
  glBindTexture(GL_TEXTURE_2D, id_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_REPEAT);
}

}  // namespace haarlight::viewer
