// Measured isotropic BRDFs as tables, in the binary form of the MERL database.

#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "core/rgb.h"

namespace haarlight {

/// f_r over Rusinkiewicz's angles: half vector and difference, theta_h, theta_d in [0, pi/2] and
/// phi_d in [0, pi), in cells of which theta_h's are square roots of even ones, fine at the
/// highlight (Matusik and others 2003, "A Data-Driven Reflectance Model"). A cell's value is that
/// of its middle. Directions of reflection of measured surfaces do not turn: phi_d and pi - phi_d
/// are the same, both taken in the mean.
struct MeasuredBrdf {
  int half_cells = 0, difference_cells = 0, azimuth_cells = 0;
  std::vector<Rgb> value;    ///< [half][difference][azimuth], sr^-1
  std::size_t negative = 0;  ///< entries below 0 or not finite, which mark what was not
                             ///< measured: taken as 0
  RgbD albedo;               ///< mean over both hemispheres, at most 1: what is scattered by it
  double half_width = 0;     ///< of the lobe about theta_h = 0, radians in light directions

  /// Linear between middles of cells. Angles in radians; those out of range are taken to its ends.
  RgbD at(double theta_half, double theta_difference, double phi_difference) const;
  /// For light at cosine_i, seen at cosine_o, `phi` apart about the normal. No cosine included; 0
  /// below the horizon.
  RgbD between(double cosine_i, double cosine_o, double phi) const;
};

/// Three counts (i32: half, difference, azimuth; 90, 90, 180 in the database), then all of red,
/// green and blue as doubles, little-endian, by the database's scales 1, 1.15, 1.66 of 1/1500.
inline constexpr double kMerlScale[3] = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
inline constexpr int kMostMerlCells = 1024;  ///< each way

/// Reads such a file. Throws Error{missing} if there is none, Error{io} if it cannot be read,
/// Error{format} unless its size is that of its counts.
MeasuredBrdf read_merl(const std::filesystem::path& file);

}  // namespace haarlight
