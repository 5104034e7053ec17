// Made-up BRDF tables in the binary form of the MERL database.

#include "data_gen/merl.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include "core/atomic_file.h"
#include "core/vec.h"

namespace haarlight::data_gen {
namespace {

constexpr double kScale[3] = {1.0 / 1500, 1.15 / 1500, 1.66 / 1500};

// Whether light and view are above the horizon: the difference turned by the half angle about y,
// and its mirror image about the half vector.
bool above(double theta_half, double theta_difference, double phi_difference) {
  const double along = std::cos(theta_half) * std::cos(theta_difference);
  const double across =
      std::sin(theta_half) * std::sin(theta_difference) * std::cos(phi_difference);
  return along > across && along > -across;
}

}  // namespace

RgbD Lacquer::at(double theta_half, double theta_difference) const {
  const double c = 1 - std::cos(theta_difference), s = c * c * c * c * c;
  const RgbD fresnel = RgbD(f0) * (1 - s) + RgbD{s, s, s};
  const double highlight = (exponent + 8) / (8 * kPi) * std::pow(std::cos(theta_half), exponent);
  return RgbD(diffuse) * (1 / kPi) + fresnel * highlight;
}

void write_merl(const std::filesystem::path& file, const Lacquer& lacquer, const MerlCells& cells) {
  const std::int32_t counts[3] = {cells.half, cells.difference, cells.azimuth};
  std::vector<double> values[3];
  for (int h = 0; h < cells.half; ++h) {
    const double share = (h + 0.5) / cells.half, theta_half = share * share * kPi / 2;
    for (int d = 0; d < cells.difference; ++d) {
      const double theta_difference = (d + 0.5) / cells.difference * kPi / 2;
      const RgbD f = lacquer.at(theta_half, theta_difference);
      for (int a = 0; a < cells.azimuth; ++a) {
        const bool lit = above(theta_half, theta_difference, (a + 0.5) / cells.azimuth * kPi);
        values[0].push_back(lit ? f.r / kScale[0] : -1);
        values[1].push_back(lit ? f.g / kScale[1] : -1);
        values[2].push_back(lit ? f.b / kScale[2] : -1);
      }
    }
  }
  AtomicFile out(file);
  out.write(counts, sizeof counts);
  for (const auto& channel : values) out.write(channel.data(), channel.size() * sizeof(double));
  out.commit();
}

}  // namespace haarlight::data_gen
