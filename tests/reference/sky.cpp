// Distant light for the reference path tracer.

#include "tests/reference/sky.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/error.h"

namespace haarlight::reference {

Sky::Sky(Cubemap light) : map_(std::move(light)) {
  const std::vector<double> solid_angle = cube_solid_angles(map_.n);
  double sum = 0;
  for (std::size_t k = 0; k < map_.texels.size(); ++k) {
    const RgbD c(map_.texels[k]);
    if (!(c.r >= 0 && c.g >= 0 && c.b >= 0)) {
      throw Error(ErrorKind::invalid_argument,
                  "sky: texel " + std::to_string(k) + " is negative, expected none");
    }
    sum += l1_norm(c) * solid_angle[k % solid_angle.size()];
    below_.push_back(sum);
  }
  if (!(sum > 0)) below_.clear();
  for (double& b : below_) b /= sum;
}

Sky::Sky(std::function<RgbD(const Vec3& direction)> light) : light_(std::move(light)) {}

RgbD Sky::radiance(const Vec3& direction) const {
  if (light_) return light_(direction);
  const CubePoint at = cube_point(direction);
  return RgbD(
      map_.texels[cube_index(at.face, cube_texel(at.u, map_.n), cube_texel(at.v, map_.n), map_.n)]);
}

// A texel is 2 / n wide in u and v, which are spread over the sphere by (1 + u^2 + v^2)^(-3/2).
double Sky::density(std::size_t texel, double u, double v) const {
  const double share = texel == 0 ? below_[0] : below_[texel] - below_[texel - 1];
  return share * (map_.n / 2.0) * (map_.n / 2.0) * std::pow(1 + u * u + v * v, 1.5);
}

std::optional<Sky::Sample> Sky::sample(double choice, double u, double v) const {
  if (below_.empty()) return std::nullopt;
  const auto found = std::upper_bound(below_.begin(), below_.end(), choice);
  const auto texel =
      static_cast<std::size_t>(std::min(found, std::prev(below_.end())) - below_.begin());
  const auto n = static_cast<std::size_t>(map_.n);
  CubePoint at;
  at.face = static_cast<int>(texel / (n * n));
  at.u = 2 * (static_cast<double>(texel % n) + u) / map_.n - 1;
  at.v = 2 * (static_cast<double>(texel / n % n) + v) / map_.n - 1;
  const double per_solid_angle = density(texel, at.u, at.v);
  if (!(per_solid_angle > 0)) return std::nullopt;
  return Sample{cube_direction(at), per_solid_angle};
}

double Sky::density(const Vec3& direction) const {
  if (below_.empty()) return 0;
  const CubePoint at = cube_point(direction);
  return density(cube_index(at.face, cube_texel(at.u, map_.n), cube_texel(at.v, map_.n), map_.n),
                 at.u, at.v);
}

}  // namespace haarlight::reference
