// A picture of distant light behind a scene that moves.

#include "caching/environment_light.h"

#include <algorithm>
#include <utility>

#include "caching/sphere_cells.h"

namespace haarlight {

EnvironmentLight::EnvironmentLight(Environment environment) : environment_(std::move(environment)) {
  constexpr int kBands = SphereTable::kBands, kColumns = SphereTable::kColumns;
  constexpr std::size_t kCells = SphereTable::kCells;
  // So many looks at a cell that no pixel falls between them.
  const int looks = std::clamp(2 * environment_.picture().width / kColumns, 4, 32);
  std::vector<double> light(kCells);
  std::vector<float> most(kCells);
  double all = 0;
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    for_looks(static_cast<int>(cell), kBands, kColumns, looks, [&](const Vec3& from, double share) {
      const double l = luminance(radiance(from));
      light[cell] += l * share;
      most[cell] = std::max(most[cell], static_cast<float>(l));
    });
    all += light[cell];
  }
  table_ = SphereTable(light, 0.1);
  suns_ = Suns(environment_, most, kColumns, looks, all / static_cast<double>(kCells));
  for (std::size_t cell = 0; cell < kCells && !suns().empty(); ++cell) {
    if (!suns_.may_take(static_cast<double>(most[cell]))) continue;
    light[cell] = 0;
    for_looks(static_cast<int>(cell), kBands, kColumns, looks, [&](const Vec3& from, double share) {
      light[cell] += luminance(radiance_without_suns(from)) * share;
    });
  }
  without_suns_ = SphereTable(light, 0.5);
}

}  // namespace haarlight
