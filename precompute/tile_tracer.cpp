// One 8x8 pixel tile -> its exact rows of the transport.

#include "precompute/tile_tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/error.h"

namespace haarlight {
namespace {

double dot_rgb(const RgbD& a, const RgbD& b) { return a.r * b.r + a.g * b.g + a.b * b.b; }
double largest(const RgbD& c) { return std::max({std::abs(c.r), std::abs(c.g), std::abs(c.b)}); }

// The one colour that the BRDFs of a pixel share: their weighted mean reflectance.
RgbD shared_color(const std::vector<PixelPoint>& points) {
  RgbD sum;
  double weight = 0;
  for (const PixelPoint& p : points) {
    sum += p.weight * (RgbD(p.albedo) + RgbD(p.specular));
    weight += p.weight;
  }
  return weight > 0 ? sum * (1 / weight) : RgbD{};
}

// How many times `base` a colour is, in the least squares sense.
double multiple_of(const RgbD& color, const RgbD& base) {
  const double square = dot_rgb(base, base);
  return square > 0 ? dot_rgb(color, base) / square : 0;
}

bool is_multiple(const RgbD& color, const RgbD& base) {
  return largest(color - base * multiple_of(color, base)) <= 0.01 * largest(base);
}

bool is_grey(const std::vector<PixelPoint>& points) {
  const RgbD base = shared_color(points);
  return std::all_of(points.begin(), points.end(), [&](const PixelPoint& p) {
    return is_multiple(RgbD(p.albedo), base) && is_multiple(RgbD(p.specular), base);
  });
}

}  // namespace

void check(const TraceOptions& options) {
  const auto refuse = [](const char* name, int value, const char* wanted) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} is {}, expected {}", name, value, wanted));
  };
  if (options.face_size < 4 || options.face_size > 256 ||
      !std::has_single_bit(static_cast<unsigned>(options.face_size))) {
    refuse("face size", options.face_size, "a power of two from 4 to 256");
  }
  if (options.spp < 1 || options.spp > 64) refuse("spp", options.spp, "1 to 64 rays a texel");
  if (options.pixel_samples != 1 && options.pixel_samples != 4 && options.pixel_samples != 16) {
    refuse("pixel samples", options.pixel_samples, "1, 4 or 16");
  }
}

namespace {

const TraceOptions& checked(const TraceOptions& options) {
  check(options);
  return options;
}

}  // namespace

TileTracer::TileTracer(const Scene& scene, const Visibility& visibility, const Camera& camera,
                       const TraceOptions& options)
    : layout_(checked(options).face_size),
      width_(camera.width),
      table_(options.face_size, options.spp),
      pixels_(scene, visibility, camera, options.pixel_samples),
      points_(visibility, table_, options.adaptive) {}

void TileTracer::trace(std::span<const std::uint32_t> outputs, Scratch& scratch, TileRows& tile,
                       RayCounts& counts) const {
  const auto size = static_cast<std::size_t>(layout_.size());
  scratch.pixels.resize(kTileRows);
  scratch.lambert.resize(size);
  scratch.lobe.resize(size);

  // What each pixel sees, and which blocks need three channels.
  tile.rgb_blocks = 0;
  tile.color.assign(kTileRows, Rgb{1, 1, 1});
  tile.coverage.assign(kTileRows, 0.0f);
  for (std::size_t row = 0; row < kTileRows; ++row) {
    std::vector<PixelPoint>& points = scratch.pixels[row];
    points.clear();
    if (outputs[row] == kNoOutput) continue;
    const auto output = static_cast<int>(outputs[row]);
    pixels_.sample(output % width_, output / width_, points, counts);
    double coverage = 0;
    for (const PixelPoint& p : points) coverage += p.weight;
    tile.coverage[row] = static_cast<float>(coverage);
    if (!is_grey(points)) tile.rgb_blocks |= 1u << (row / kBlockRows);
  }

  const std::size_t channels = tile.rgb_blocks == 0 ? 1 : 3;
  tile.values.assign(channels * kTileRows * size, 0.0f);
  for (std::size_t row = 0; row < kTileRows; ++row) {
    const std::vector<PixelPoint>& points = scratch.pixels[row];
    if (points.empty()) continue;
    const bool rgb = (tile.rgb_blocks >> (row / kBlockRows) & 1u) != 0;
    const RgbD base = shared_color(points);
    if (!rgb) tile.color[row] = Rgb(base);
    const std::size_t row_channels = rgb ? 3 : 1;
    scratch.texels.assign(row_channels * size, 0.0f);
    for (const PixelPoint& p : points) {
      points_.trace(p.point, scratch.lambert, scratch.lobe, scratch.point, counts);
      for (std::size_t c = 0; c < row_channels; ++c) {
        const auto factor = [&](const RgbD& color) {
          if (!rgb) return multiple_of(color, base);
          return c == 0 ? color.r : c == 1 ? color.g : color.b;
        };
        const auto diffuse = static_cast<float>(p.weight * factor(RgbD(p.albedo)));
        float* sum = scratch.texels.data() + c * size;
        for (std::size_t k = 0; k < size; ++k) sum[k] += diffuse * scratch.lambert[k];
        if (!p.point.glossy) continue;
        const auto gloss = static_cast<float>(p.weight * factor(RgbD(p.specular)));
        for (std::size_t k = 0; k < size; ++k) sum[k] += gloss * scratch.lobe[k];
      }
    }
    for (std::size_t c = 0; c < row_channels; ++c) {
      haar_forward(layout_, std::span<const float>(scratch.texels).subspan(c * size, size),
                   std::span<float>(tile.values).subspan((c * kTileRows + row) * size, size));
    }
  }
}

}  // namespace haarlight
