// A mesh with its clusters in colours of their own (Overbeck 2006, Fig. 12, left).

#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "prt/mesh_picture.h"
#include "prt/transport.h"

namespace haarlight {

/// The colour of a cluster: bright, saturated, next numbers far apart; channels in [0, 1], linear.
Rgb cluster_colour(std::uint32_t cluster);

class ClusterColours {
 public:
  /// Throws Error{invalid_argument} unless the transport is of clusters.
  explicit ClusterColours(const Transport& transport);

  /// The mesh from `camera`, a cluster's vertices in its colour; kept until the camera changes.
  const Image& picture(const Camera& camera);

 private:
  MeshPicture drawing_;
  std::vector<Rgb> colour_;  // a vertex
  std::optional<Camera> camera_;
  Image picture_;
};

}  // namespace haarlight
