// Small bright suns of a picture.

#include "caching/suns.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "caching/sphere_cells.h"

namespace haarlight {
namespace {

// A look at the picture that is brighter than suns begin to be.
struct Look {
  Vec3 from;
  RgbD above;  // times its solid angle
};

// Of all looks within a cosine of a direction.
struct Light {
  Vec3 middle;
  RgbD irradiance;
};

Light within(const std::vector<std::vector<Look>>& cells, const Vec3& axis, double least_cosine) {
  // Looks are within this of the first of their cell, of 96 bands: the tallest is at a pole.
  constexpr double kCell = 0.25;
  const double near = std::cos(std::min(std::acos(least_cosine) + kCell, kPi));
  Light light;
  for (const auto& cell : cells) {
    if (dot(cell.front().from, axis) < near) continue;
    for (const Look& look : cell) {
      if (!(dot(look.from, axis) > least_cosine)) continue;
      light.irradiance += look.above;
      light.middle = light.middle + look.from * luminance(look.above);
    }
  }
  return light;
}

}  // namespace

Suns::Suns(const Environment& environment, const std::vector<float>& cell_most, int columns,
           int looks, double mean)
    : cap_(kBright * mean), least_cosine_(std::cos(kRadius)) {
  const auto cells = static_cast<double>(cell_most.size());
  const int bands = static_cast<int>(cell_most.size()) / columns;
  const double solid_angle = 4 * kPi / cells;
  std::vector<std::vector<Look>> bright;
  for (std::size_t cell = 0; cell < cell_most.size(); ++cell) {
    if (!(static_cast<double>(cell_most[cell]) > cap_)) continue;
    std::vector<Look> here;
    for_looks(static_cast<int>(cell), bands, columns, looks, [&](const Vec3& from, double share) {
      const RgbD more = above(RgbD(environment.radiance(from))) * (share * solid_angle);
      if (l1_norm(more) > 0) here.push_back({from, more});
    });
    if (!here.empty()) bright.push_back(std::move(here));
  }
  const double least = 0.01 * 4 * kPi * mean;
  // Brightest cell first, each with what is about it.
  while (!bright.empty() && sun_.size() < kMost) {
    std::vector<Look>* most = &bright.front();
    double most_light = 0;
    for (auto& cell : bright) {
      double sum = 0;
      for (const Look& look : cell) sum += luminance(look.above);
      if (sum > most_light) most = &cell, most_light = sum;
    }
    if (!(most_light > 0)) return;
    Vec3 axis;
    for (const Look& look : *most) axis = axis + look.from * luminance(look.above);
    axis = normalize(axis);
    // A cell's middle is not the sun's, whose light it may share with its neighbours.
    for (int i = 0; i < 4; ++i) axis = normalize(within(bright, axis, least_cosine_).middle);
    const Light sun = within(bright, axis, least_cosine_);
    const Light about = within(bright, axis, std::cos(3 * kRadius));
    const double light = luminance(sun.irradiance);
    if (light < least) return;
    const bool small = light > 0.6 * luminance(about.irradiance);
    if (small) {
      sun_.push_back({normalize(sun.middle), sun.irradiance});
      axis_.push_back(axis);
    }
    // It is taken, or it is no sun, and neither is what is near it.
    const double taken = small ? least_cosine_ : std::cos(3 * kRadius);
    for (auto& cell : bright) {
      std::erase_if(cell, [&](const Look& look) { return dot(look.from, axis) > taken; });
    }
    std::erase_if(bright, [](const auto& cell) { return cell.empty(); });
  }
}

}  // namespace haarlight
