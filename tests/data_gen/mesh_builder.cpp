// The surfaces that scenes are built from: closed, turned outwards, of the size that was asked for.

#include "data_gen/mesh_builder.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/data_gen/volume.h"

namespace haarlight::data_gen {
namespace {

double smallest_agreement_of_normals(const Scene& scene) {
  double smallest = 1;
  for (const Triangle& t : scene.triangle) {
    const Vec3 &a = scene.position[t.vertex[0]], &b = scene.position[t.vertex[1]],
               &c = scene.position[t.vertex[2]];
    const Vec3 flat = normalize(cross(b - a, c - a));
    for (const auto v : t.vertex) smallest = std::min(smallest, dot(flat, scene.normal[v]));
  }
  return smallest;
}

Scene built(const std::function<void(MeshBuilder&, std::uint32_t)>& add) {
  MeshBuilder builder;
  add(builder, builder.add_material("m", {0.5f, 0.5f, 0.5f}));
  return builder.finish(look_at({0, 0, 5}, {0, 0, 0}, 0.7, 64, 64));
}

TEST(MeshBuilder, BoxHasItsVolumeHoweverItIsTurned) {
  for (const double turn : {0.0, 0.3, 2.0}) {
    const Scene box = built([&](MeshBuilder& b, std::uint32_t m) {
      b.add_box(m, {3, -2, 1}, {2, 3, 0.5}, turn);
    });
    EXPECT_NEAR(volume(box), 3.0, 1e-12);
    EXPECT_NEAR(smallest_agreement_of_normals(box), 1.0, 1e-12);
  }
}

TEST(MeshBuilder, EllipsoidVolumeApproachesTheClosedForm) {
  const double exact = 4 * kPi / 3 * 0.5 * 1.0 * 0.25;
  double last = 1;
  for (const int segments : {16, 32, 64, 128}) {
    const Scene scene = built([&](MeshBuilder& b, std::uint32_t m) {
      b.add_ellipsoid(m, {1, 2, 3}, {0.5, 1.0, 0.25}, segments);
    });
    const double missing = 1 - volume(scene) / exact;
    EXPECT_GT(missing, 0) << segments;  // inscribed
    if (segments > 16) {
      EXPECT_NEAR(last / missing, 4.0, 0.1) << segments;  // second order
    }
    last = missing;
    EXPECT_GT(smallest_agreement_of_normals(scene), 0.7) << segments;
  }
}

TEST(MeshBuilder, TubeAndLatheFaceOutwards) {
  // Their open ends lie on the plane y = 0 through the origin or are covered by the same prism on
  // both sides: the flux of (x, 0, z) / 2 through the wall is the volume inside.
  const auto side_flux = [](const Scene& scene) {
    double sum = 0;
    for (const Triangle& t : scene.triangle) {
      const Vec3 &a = scene.position[t.vertex[0]], &b = scene.position[t.vertex[1]],
                 &c = scene.position[t.vertex[2]];
      const Vec3 middle = (a + b + c) * (1.0 / 3);
      sum += dot(Vec3{middle.x, 0, middle.z}, cross(b - a, c - a)) / 4;
    }
    return sum;
  };
  constexpr int kSides = 24;
  // Area of a regular polygon of 24 corners on the circle of radius 0.3.
  const double area = 0.5 * kSides * 0.09 * std::sin(2 * kPi / kSides);
  const Scene tube = built([](MeshBuilder& b, std::uint32_t m) {
    const std::array path{Vec3{0, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 2, 0}};
    const std::array radii{0.3, 0.3, 0.3};
    b.add_tube(m, path, radii, kSides);
  });
  EXPECT_NEAR(side_flux(tube), 2 * area, 1e-12);
  EXPECT_GT(smallest_agreement_of_normals(tube), 0.98);
  const Scene lathe = built([](MeshBuilder& b, std::uint32_t m) {
    const std::array profile{ProfilePoint{0.3, 0}, ProfilePoint{0.3, 2}};
    b.add_lathe(m, {0, 0, 0}, profile, kSides);
  });
  EXPECT_NEAR(side_flux(lathe), 2 * area, 1e-12);
  EXPECT_GT(smallest_agreement_of_normals(lathe), 0.98);
}

TEST(MeshBuilder, GridLeavesOutTrianglesWithoutArea) {
  // A fan: the whole last row is one point.
  const Scene fan = built([](MeshBuilder& b, std::uint32_t m) {
    b.add_grid(m, 8, 2, [](double s, double t) { return Vec3{(s - 0.5) * (1 - t), t, 0}; });
  });
  EXPECT_EQ(fan.triangle.size(), 8u * 2 + 8);
  for (const Vec3& normal : fan.normal) EXPECT_EQ(normal, (Vec3{0, 0, 1}));
}

}  // namespace
}  // namespace haarlight::data_gen
