// The distant lights that the project makes itself, as functions of direction and as pictures.

#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "core/image.h"
#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/projection.h"

namespace haarlight::data_gen {

/// A round light far away: `radiance` (W m^-2 sr^-1) is added within `half_angle` (radians) of
/// `direction` (unit).
struct DiscLight {
  Vec3 direction;
  double half_angle = 0;
  RgbD radiance;

  /// Exact solid angle in sr, 2 pi (1 - cos half_angle).
  double solid_angle() const;
};

/// An environment before it is a picture. Small bright lights are kept apart, because a picture
/// must sample them more finely than the rest.
struct EnvironmentModel {
  std::function<RgbD(const Vec3& direction)> smooth;  ///< all but the discs; unit direction
  std::vector<DiscLight> discs;
  bool display_referred = false;  ///< within [0, 1], so that it may be saved as PNG

  /// smooth plus the discs that cover `direction`.
  RgbD radiance(const Vec3& direction) const;
};

struct EnvironmentEntry {
  std::string_view name;
  std::string_view description;
  EnvironmentModel (*make)(std::uint64_t seed);
};

/// All environments, in the order of the help text.
std::span<const EnvironmentEntry> environments();

/// The environment of that name; the same seed gives the same light. Throws
/// Error{invalid_argument} listing the names.
EnvironmentModel make_environment(std::string_view name, std::uint64_t seed = 1);

/// An interior at night with windows to the dusk: dark walls, pictures, small very bright lamps.
EnvironmentModel make_gallery(std::uint64_t seed);
/// A clear sky with the sun's disc over bare ground.
EnvironmentModel make_sky(std::uint64_t seed);
/// A cloudy sky with a bright part where the sun stands, over grass.
EnvironmentModel make_clouds(std::uint64_t seed);
/// The six axes as coloured discs with their names beside them; see docs/environments.md.
EnvironmentModel make_labels(std::uint64_t seed);

/// Draws a model in one of the layouts of wavelet/projection.h. `size` is the width in pixels;
/// the height follows: half for latlong, the same for angular, 4/3 for vertical-cross. Pixels are
/// means over 4 x 4 places, near discs over 16 x 16; pixels wholly outside the layout are black.
/// Throws Error{invalid_argument} unless size is in [8, 16384], even for latlong and a multiple of
/// 3 for vertical-cross.
Image draw_environment(const EnvironmentModel& model, Projection projection, int size);

}  // namespace haarlight::data_gen
