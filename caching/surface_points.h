// What the pixels of a picture see, lit directly: where indirect light is asked for.

#pragma once

#include <functional>
#include <span>
#include <vector>

#include "caching/body_place.h"
#include "caching/moving_visibility.h"
#include "caching/virtual_lights.h"
#include "core/camera.h"
#include "core/image.h"

namespace haarlight {

/// A place that a pixel sees, straight or by way of mirrors or a lobe, and that irradiance lights.
struct SurfacePoint {
  BodyPlace place;
  Vec3 position, geometric_normal, normal;  ///< local; `normal` without normal textures
  RgbD weight;                              ///< of its irradiance in the pixel
};

/// The points of a row of the picture.
struct SurfaceRow {
  std::vector<SurfacePoint> point;
  std::vector<std::size_t> first;  ///< by x, width + 1 numbers: where a pixel's points begin
  int width() const { return static_cast<int>(first.size()) - 1; }
};

struct SurfacePointOptions {
  int light_points = 4;    ///< on each shining material: one shadow ray each
  int glossy_samples = 4;  ///< rays of a narrow lobe, a pixel; 0: lobes show lights alone
};

/// One ray through the middle of each pixel, on through mirrors and glass (up to 8, while a
/// thousandth of the light is left) and along narrow lobes once. `picture` receives the light of
/// lamps, of shining materials, of the background's small suns and of the background where it is
/// seen, hard shadows; `rows` the points. Lamps do not shine through glass. `progress_row` is
/// called after each few rows.
void surface_points(const MovingVisibility& scene, const Camera& camera,
                    const SurfacePointOptions& options, Image& picture,
                    std::vector<SurfaceRow>& rows,
                    const std::function<void(int rows_done)>& progress_row = {});

}  // namespace haarlight
