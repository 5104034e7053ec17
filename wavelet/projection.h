// The picture layouts that distant light comes in, and which pixel of them is which direction.

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/vec.h"

namespace haarlight {

/// All three look from inside with front = -Z in the middle, right = +X, up = +Y, nothing mirrored.
/// (u, v) run over the whole picture in [0, 1], u to the right, v down.
enum class Projection {
  latlong,  ///< width = 2 height. Middle -Z, u = 3/4 is +X, left and right border +Z, top +Y.
  angular,  ///< square. Debevec light probe: middle -Z, rim +Z, distance from the middle is
            ///< angle / pi. Pixels outside the disc carry nothing.
  vertical_cross,  ///< 3 faces wide, 4 high. Row 0: +Y; row 1: -X, -Z, +X; row 2: -Y; row 3: +Z
                   ///< (upside down, as the cross folds).
};

/// Direction (unit) of a place in the picture, or nothing where the layout holds no light.
std::optional<Vec3> projection_direction(Projection projection, double u, double v);

/// Place of a direction of any non-zero length; the inverse of projection_direction.
struct PicturePoint {
  double u = 0, v = 0;
};
PicturePoint projection_point(Projection projection, const Vec3& direction);

/// Layout by the shape of the picture: 2:1 latlong, 1:1 angular, 3:4 vertical cross; nothing else.
std::optional<Projection> projection_of_shape(int width, int height);

/// "latlong", "angular", "vertical-cross"; nothing for another word.
std::optional<Projection> projection_from_name(std::string_view name);
std::string projection_name(Projection projection);

}  // namespace haarlight
