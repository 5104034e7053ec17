// The sky as light that has been reflected sees it: squares of texels, in phases.

#include "precompute/indirect_sky.h"

#include <algorithm>
#include <span>

#include "core/simd.h"
#include "precompute/row_products.h"
#include "prt/prior_lighting.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

// Sums of the texels of each square of one line of squares, width lines of texels.
HAARLIGHT_MULTIVERSION
void sum_squares(const float* texels, std::size_t side, std::size_t width, float* sums) {
  if (width == 1) {
    for (std::size_t x = 0; x < side; ++x) sums[x] = texels[x];
    return;
  }
  if (width == 2) {
    const float* next = texels + 2 * side;
    for (std::size_t x = 0; x < side; ++x) {
      sums[x] = (texels[2 * x] + texels[2 * x + 1]) + (next[2 * x] + next[2 * x + 1]);
    }
    return;
  }
  for (std::size_t x = 0; x < side; ++x) sums[x] = 0;
  for (std::size_t y = 0; y < width; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      for (std::size_t i = 0; i < width; ++i) sums[x] += texels[(y * side + x) * width + i];
    }
  }
}

// The way back, each texel with its share.
HAARLIGHT_MULTIVERSION
void spread_squares(const float* sums, const float* share, std::size_t side, std::size_t width,
                    float* texels) {
  if (width == 1) {
    for (std::size_t x = 0; x < side; ++x) texels[x] += share[x] * sums[x];
    return;
  }
  for (std::size_t y = 0; y < width; ++y) {
    float* to = texels + y * side * width;
    const float* of = share + y * side * width;
    if (width == 2) {
      for (std::size_t x = 0; x < side; ++x) {
        to[2 * x] += of[2 * x] * sums[x];
        to[2 * x + 1] += of[2 * x + 1] * sums[x];
      }
      continue;
    }
    for (std::size_t x = 0; x < side; ++x) {
      for (std::size_t i = 0; i < width; ++i) to[x * width + i] += of[x * width + i] * sums[x];
    }
  }
}

}  // namespace

IndirectSky::IndirectSky(const DirectionTable& table, int resolution)
    : layout_(table.n),
      directions_(table, resolution),
      side_(static_cast<std::size_t>(resolution)),
      width_(static_cast<std::size_t>(table.n / resolution)),
      share_(directions_.share()) {
  const auto texels = static_cast<std::size_t>(layout_.size());
  const std::size_t squares = 6 * side_ * side_;  // a multiple of 8: at least 4 along an edge
  place_.resize(squares);
  const auto square_of = [&](std::size_t texel) {
    const auto n = static_cast<std::size_t>(table.n);
    const std::size_t x = texel % n / width_, line = texel / n / width_;
    return line * side_ + x;
  };
  for (std::size_t k = 0; k < texels; ++k) {
    place_[square_of(k)] = static_cast<std::uint32_t>(directions_.square()[k]);
  }

  const auto& lightings = prior_lightings(layout_);
  lights_ = (lightings.size() + 3) / 4 * 4;
  light_.assign(lights_ * row_size(), 0.0f);
  light_squares_.assign(lights_ * squares, 0.0f);
  light_texels_.assign(lights_ * texels, 0.0f);
  std::vector<float> of(texels);
  for (std::size_t l = 0; l < lightings.size(); ++l) {
    haar_inverse(layout_, lightings[l], std::span<float>(of));
    for (std::size_t k = 0; k < texels; ++k) {
      const auto at = static_cast<std::size_t>(directions_.square()[k]);
      const std::size_t square = square_of(k);
      const float part = of[k] * share_[k];
      light_[(at / 8 * lights_ + l) * 8 + at % 8] += part;
      light_squares_[(square / 8 * lights_ + l) * 8 + square % 8] += part;
      light_texels_[k * lights_ + l] = of[k];
    }
  }
}

void IndirectSky::add_picture(const float* texels, float* picture) const {
  thread_local std::vector<float> squares;
  squares.resize(place_.size());
  for (std::size_t line = 0; line < 6 * side_; ++line) {
    sum_squares(texels + line * width_ * side_ * width_, side_, width_,
                squares.data() + line * side_);
  }
  add_dot_products(squares.data(), squares.size() / 8, light_squares_.data(), lights_, picture);
}

void IndirectSky::add_sums(const float* sums, float scale, float* texels) const {
  thread_local std::vector<float> line;
  line.resize(side_);
  for (std::size_t i = 0; i < 6 * side_; ++i) {
    const std::uint32_t* place = place_.data() + i * side_;
    for (std::size_t x = 0; x < side_; ++x) line[x] = scale * sums[place[x]];
    const std::size_t at = i * side_ * width_ * width_;
    spread_squares(line.data(), share_.data() + at, side_, width_, texels + at);
  }
}

}  // namespace haarlight
