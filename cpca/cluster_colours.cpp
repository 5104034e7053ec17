// A mesh with its clusters in colours of their own.

#include "cpca/cluster_colours.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace haarlight {

Rgb cluster_colour(std::uint32_t cluster) {
  // Hues a golden section of the circle apart: any run of them is spread evenly.
  const double hue = 6 * std::fmod(0.6180339887498949 * cluster, 1.0);
  const double value = cluster % 2 == 0 ? 1.0 : 0.55;
  const auto channel = [&](double at) {
    const double distance = std::abs(std::remainder(hue - at, 6.0));
    return static_cast<float>(value * (0.08 + 0.92 * std::clamp(2.0 - distance, 0.0, 1.0)));
  };
  return {channel(0), channel(2), channel(4)};
}

ClusterColours::ClusterColours(const Transport& transport) : drawing_(transport.info().mesh) {
  const auto& clusters = transport.info().clusters;
  if (!clusters) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of pixels or vertices, expected one of clusters");
  }
  colour_.resize(clusters->vertex.size());
  for (std::uint32_t c = 0; c < static_cast<std::uint32_t>(clusters->clusters()); ++c) {
    for (std::uint32_t p = clusters->first_vertex[c]; p < clusters->first_vertex[c + 1]; ++p) {
      colour_[clusters->vertex[p]] = cluster_colour(c);
    }
  }
}

const Image& ClusterColours::picture(const Camera& camera) {
  if (camera_ && *camera_ == camera) return picture_;
  drawing_.look(camera);
  drawing_.shade(colour_, picture_);
  camera_ = camera;
  return picture_;
}

}  // namespace haarlight
