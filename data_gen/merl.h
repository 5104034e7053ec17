// Made-up BRDF tables in the binary form of the MERL database.

#pragma once

#include <filesystem>

#include "core/rgb.h"

namespace haarlight::data_gen {

/// A lacquer: f_r = diffuse / pi + specular(theta_d) (e + 8) / (8 pi) cos^e theta_h, the highlight
/// of Blinn with Schlick's Fresnel, F0 + (1 - F0) (1 - cos theta_d)^5.
struct Lacquer {
  Rgb diffuse{0.35f, 0.05f, 0.03f};
  Rgb f0{0.06f, 0.06f, 0.06f};
  double exponent = 60;
  RgbD at(double theta_half, double theta_difference) const;
};

/// Cells of a table: half angle, difference angle, azimuth.
struct MerlCells {
  int half = 90, difference = 90, azimuth = 180;
};

/// Writes the BRDF's values in the middles of cells; -1 where light or view are below the horizon,
/// as measurements have it. Throws Error{io} if the file cannot be written.
void write_merl(const std::filesystem::path& file, const Lacquer& lacquer,
                const MerlCells& cells = {});

}  // namespace haarlight::data_gen
