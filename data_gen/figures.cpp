// Figures to stand about in scenes.

#include "data_gen/figures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data_gen/isosurface.h"
#include "data_gen/noise.h"

namespace haarlight::data_gen {
namespace {

double bunny(const Vec3& p) {
  const Vec3 q{p.x, p.y, std::abs(p.z)};  // left and right are alike
  double d = ellipsoid_distance(q, {-0.02, 0.20, 0}, {0.23, 0.185, 0.165});
  d = smooth_union(d, sphere_distance(q, {-0.10, 0.14, 0.09}, 0.125), 0.05);  // haunch
  d = smooth_union(d, sphere_distance(q, {0.13, 0.21, 0}, 0.125), 0.08);      // chest
  d = smooth_union(d, rod_distance(q, {-0.03, 0.032, 0.13}, {0.12, 0.03, 0.135}, 0.036, 0.03),
                   0.03);
  d = smooth_union(d, rod_distance(q, {0.17, 0.16, 0.06}, {0.19, 0.035, 0.065}, 0.05, 0.03), 0.04);
  d = smooth_union(d, rod_distance(q, {0.19, 0.03, 0.065}, {0.25, 0.028, 0.07}, 0.03, 0.027), 0.02);
  d = smooth_union(d, ellipsoid_distance(q, {0.22, 0.385, 0}, {0.12, 0.105, 0.095}), 0.06);  // head
  d = smooth_union(d, ellipsoid_distance(q, {0.315, 0.355, 0.02}, {0.055, 0.045, 0.04}), 0.04);
  d = smooth_union(d, rod_distance(q, {0.19, 0.46, 0.045}, {0.06, 0.655, 0.095}, 0.03, 0.034),
                   0.03);
  d = smooth_union(d, sphere_distance(q, {-0.255, 0.17, 0}, 0.06), 0.02);  // tail
  // The hollows of the ears, and the eyes.
  d = -smooth_union(-d, rod_distance(q, {0.195, 0.50, 0.055}, {0.095, 0.64, 0.10}, 0.015, 0.02),
                    0.01);
  d = smooth_union(d, sphere_distance(q, {0.265, 0.415, 0.075}, 0.018), 0.006);
  // Fur.
  return d + 0.0025 * fractal_noise(p * 28, 2);
}

double statue(const Vec3& point) {
  // The weight rests on one leg: hips and shoulders lean against each other.
  const Vec3 p{point.x - 0.03 * std::sin(5 * point.y), point.y,
               point.z - 0.015 * std::cos(4 * point.y)};
  const Vec3 q{std::abs(p.x), p.y, p.z};
  const double around = std::atan2(p.z, p.x);
  double dress = rod_distance(p, {0, 0.06, 0}, {0, 0.56, 0}, 0.165, 0.105);
  const double folds = std::clamp((0.62 - p.y) / 0.3, 0.0, 1.0);
  dress +=
      folds * (0.011 * std::cos(14 * around + 9 * p.y) + 0.006 * std::cos(9 * around - 14 * p.y));
  double d = smooth_union(dress, ellipsoid_distance(p, {0, 0.60, 0}, {0.135, 0.10, 0.105}), 0.06);
  d = smooth_union(d, rod_distance(p, {0, 0.62, 0}, {0, 0.76, 0.005}, 0.095, 0.085), 0.05);
  d = smooth_union(d, ellipsoid_distance(p, {0, 0.845, 0}, {0.115, 0.115, 0.085}), 0.05);
  d = smooth_union(d, sphere_distance(q, {0.05, 0.845, 0.06}, 0.047), 0.03);
  d = smooth_union(d, rod_distance(q, {0, 0.935, -0.01}, {0.125, 0.925, -0.01}, 0.045, 0.043),
                   0.04);
  d = smooth_union(d, rod_distance(q, {0.145, 0.92, -0.01}, {0.165, 0.80, 0.0}, 0.042, 0.037),
                   0.02);
  d = smooth_union(d, rod_distance(p, {0, 0.95, -0.005}, {0.005, 1.03, 0.01}, 0.042, 0.037), 0.04);
  d = smooth_union(d, ellipsoid_distance(p, {0.005, 1.105, 0.02}, {0.062, 0.085, 0.072}), 0.02);
  d = smooth_union(d, ellipsoid_distance(p, {0.005, 1.135, -0.005}, {0.073, 0.07, 0.075}), 0.015);
  d = smooth_union(d, sphere_distance(p, {0.005, 1.115, -0.085}, 0.04), 0.02);
  d = smooth_union(d, rod_distance(p, {0.005, 1.10, 0.085}, {0.005, 1.085, 0.1}, 0.008, 0.012),
                   0.015);
  // The band of the dress, and the foot.
  const double ring = std::hypot(std::hypot(p.x / 1.1, p.z) - 0.1, p.y - 0.72) - 0.012;
  d = smooth_union(d, ring, 0.015);
  const Vec3 disc{std::max(std::hypot(point.x, point.z) - 0.21, 0.0),
                  std::abs(point.y - 0.03) - 0.025, 0};
  const double foot = std::hypot(disc.x, std::max(disc.y, 0.0)) - 0.005;
  return std::max(smooth_union(d, foot, 0.02), -point.y);  // it stands flat
}

}  // namespace

Scene make_bunny(int cells) {
  return isosurface(bunny, {-0.36, -0.03, -0.26}, {0.42, 0.75, 0.26}, cells);
}

Scene make_statue(int cells) {
  return isosurface(statue, {-0.26, -0.03, -0.26}, {0.26, 1.25, 0.26}, cells);
}

Scene as_figure(Scene scene, double height) {
  constexpr double kMax = std::numeric_limits<double>::max();
  Vec3 low{kMax, kMax, kMax}, high{-kMax, -kMax, -kMax};
  for (const Vec3& p : scene.position) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const double scale = high.y > low.y ? height / (high.y - low.y) : 1;
  const Vec3 foot{(low.x + high.x) / 2, low.y, (low.z + high.z) / 2};
  for (Vec3& p : scene.position) p = (p - foot) * scale;
  for (Triangle& t : scene.triangle) t.material = 0;
  scene.material.assign(1, Material());
  scene.texture.clear(), scene.alpha.clear();
  return scene;
}

}  // namespace haarlight::data_gen
