// Vertices as places to look from: nothing seen through a wall, nothing hidden by its own body.

#include "precompute/vertex_sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "precompute/direction_table.h"
#include "precompute/point_tracer.h"
#include "precompute/surface.h"
#include "precompute/texture.h"
#include "prt/transport.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

double irradiance(const PointTracer& tracer, const ShadingPoint& point) {
  std::vector<float> lambert(tracer.table().texels());
  PointScratch scratch;
  RayCounts counts;
  tracer.trace(point, lambert, {}, scratch, counts);
  double sum = 0;
  for (const float l : lambert) sum += static_cast<double>(l);
  return sum;
}

// Irradiance over pi of every vertex under an even sky, and the same when nothing is there.
struct Seen {
  std::vector<double> share, open;
};
Seen look(const Scene& scene) {
  const Visibility visibility(scene);
  const DirectionTable table(16, 4);
  const PointTracer tracer(visibility, table, true), free(visibility, table, true, false);
  const VertexSampler sampler(scene, visibility);
  Seen seen;
  for (std::uint32_t v = 0; v < scene.position.size(); ++v) {
    seen.share.push_back(irradiance(tracer, sampler.point(v)));
    seen.open.push_back(irradiance(free, sampler.point(v)));
  }
  return seen;
}

TEST(VertexSampler, ConvexBodiesCastNoShadowOnThemselves) {
  for (const double scale : {1e-3, 1.0, 1e4}) {
    for (const Vec3& by : {Vec3{}, Vec3{1000, -300, 20}}) {
      Scene box = shapes::empty_scene();
      shapes::add_box(box, {-1, 0, -0.2}, {1, 2, 0.3});
      Scene sphere = shapes::empty_scene();
      shapes::add_sphere(sphere, {0, 0, 0}, 1, 3);
      for (const Scene& scene : {box, sphere}) {
        const Seen seen = look(shapes::moved(scene, scale, scale * by));
        // Not one ray may be blocked: the same sums of the same floats.
        for (std::size_t v = 0; v < seen.share.size(); ++v) {
          EXPECT_EQ(seen.share[v], seen.open[v]) << "vertex " << v;
          EXPECT_NEAR(seen.open[v], 1, 0.01);
        }
      }
    }
  }
}

TEST(VertexSampler, ClosedRoomsDoNotLeak) {
  // Boxes with their faces turned inwards, one with acute corners, one with rounded edges. Every
  // vertex lies in a corner or on a wall.
  Scene room = shapes::empty_scene();
  shapes::add_box(room, {-1, 0, -1}, {1, 2, 1});
  Scene wedge = shapes::empty_scene();  // a triangle of 15 degrees, 1 high
  const Vec3 a{0, 0, 0}, b{4, 0, 0}, c{4, 0, 4 * std::tan(kPi / 12)}, up{0, 1, 0};
  shapes::add_quad(wedge, a, up, b - a);
  shapes::add_quad(wedge, b, up, c - b);
  shapes::add_quad(wedge, c, up, a - c);
  for (const Vec3& lift : {Vec3{}, up}) {
    const Vec3 normal = lift == up ? Vec3{0, 1, 0} : Vec3{0, -1, 0};
    const std::uint32_t first = shapes::add_vertex(wedge, a + lift, normal);
    shapes::add_vertex(wedge, b + lift, normal);
    shapes::add_vertex(wedge, c + lift, normal);
    wedge.triangle.push_back({{first, first + 1, first + 2}, 0});
  }
  Scene ball = shapes::empty_scene();
  shapes::add_sphere(ball, {0, 0, 0}, 1, 3);
  for (Scene scene : {room, wedge, ball}) {
    for (Vec3& n : scene.normal) n = -n;
    for (const double scale : {1.0, 1e5}) {
      const Seen seen = look(shapes::moved(scene, scale, {3, 7, -11}));
      for (std::size_t v = 0; v < seen.share.size(); ++v) {
        EXPECT_EQ(seen.share[v], 0) << "vertex " << v << " at scale " << scale;
      }
    }
  }
}

// The foot of an endless wall hides half of the floor's sky; that of two across each other three
// quarters. Walls 300 high and wide are endless to within 1 / 300 or so of the sky.
TEST(VertexSampler, FeetOfWallsSeeTheirShareOfTheSky) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {0, 0, 0}, {0, 0, 1}, {1, 0, 0});
  shapes::add_quad(scene, {0, 0, -300}, {0, 300, 0}, {0, 0, 300});
  shapes::add_quad(scene, {0, 0, 0}, {0, 300, 0}, {0, 0, 300});
  ASSERT_EQ(scene.position[0], Vec3{});
  EXPECT_NEAR(look(scene).share[0], 0.5, 0.02);
  shapes::add_quad(scene, {0, 0, 0}, {300, 0, 0}, {0, 300, 0});
  EXPECT_NEAR(look(scene).share[0], 0.25, 0.02);
}

// A box that stands on a floor shares no vertex with it. Its sides' lower vertices are in the
// floor's plane: they see half of the sky above it and none of that below.
TEST(VertexSampler, BodiesOnFloorsAreNotSunkIntoThem) {
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {-1, 0, -1}, {1, 2, 1});
  const std::size_t box = scene.position.size();
  shapes::add_quad(scene, {-300, 0, -300}, {0, 0, 600}, {600, 0, 0});
  for (const double turn : {0.0, 0.3}) {
    Scene turned = scene;
    for (Vec3& p : turned.position) p = rotation_x(turn) * rotation_y(2 * turn) * p;
    for (Vec3& n : turned.normal) n = rotation_x(turn) * rotation_y(2 * turn) * n;
    const Seen seen = look(turned);
    for (std::size_t v = 0; v < box; ++v) {
      if (scene.normal[v].y != 0 || scene.position[v].y != 0) continue;
      EXPECT_NEAR(seen.share[v], 0.5, 0.02) << "vertex " << v;
    }
  }
}

TEST(VertexSampler, KeepsTheDiffusePartAlone) {
  Scene scene = shapes::empty_scene();
  scene.material.resize(4);
  scene.material[0].albedo = {0.2f, 0.4f, 0.8f};
  scene.material[0].specular = {0.5f, 0.5f, 0.5f};
  scene.material[1].model = SurfaceModel::metallic_roughness;
  scene.material[1].albedo = {0.9f, 0.6f, 0.3f};
  scene.material[1].roughness = 0.5f;
  scene.material[2].model = SurfaceModel::mirror;
  scene.material[3].albedo = {0.5f, 0.5f, 0.5f};
  for (std::uint32_t m = 0; m < 4; ++m) {
    shapes::add_quad(scene, {3.0 * m, 0, 0}, {0, 0, 1}, {1, 0, 0}, m);
  }
  scene.tint.assign(scene.position.size(), Rgb{1, 1, 1});
  scene.tint[13] = {0.5f, 1, 0};
  const Visibility visibility(scene);
  const VertexSampler sampler(scene, visibility);
  EXPECT_EQ(sampler.view_dependent(), 12);

  const Bsdf phong = sampler.receiver(0, 0).bsdf;
  EXPECT_FALSE(phong.has_lobe());
  EXPECT_EQ(RgbD(scene.material[0].albedo), phong.diffuse_out(phong.to_viewer));
  EXPECT_TRUE(sampler.receiver(8, 0).bsdf.delta_count == 0);
  EXPECT_FALSE(sampler.receiver(8, 0).bsdf.has_diffuse());
  EXPECT_EQ(sampler.receiver(13, 0).bsdf.diffuse_out({0, 1, 0}), RgbD(0.25, 0.5, 0));

  // Under a coat: out and in together, over all views, are what the BSDF's own diffuse part
  // reflects: mean over o (cosine-weighted) of diffuse_out is the constant that is kept.
  const Bsdf coat = sampler.receiver(4, 0).bsdf;
  EXPECT_FALSE(coat.has_lobe());
  SurfaceHit hit;
  hit.geometric_normal = hit.normal = hit.to_viewer = {0, 1, 0};
  hit.material = 1;
  hit.albedo = scene.material[1].albedo;
  hit.metallic = 0, hit.roughness = 0.5f;
  const Bsdf full = bsdf_at(scene, hit);
  RgbD mean;
  constexpr int kSide = 200;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec3 o =
        cosine_direction(full.normal, (i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide);
    mean += full.diffuse_out(o) * (1.0 / (kSide * kSide));
  }
  const RgbD kept = coat.diffuse_out(coat.to_viewer);
  EXPECT_NEAR(kept.r, mean.r, 2e-3 * mean.r);  // the table of coats is linear between its entries
  EXPECT_NEAR(kept.g, mean.g, 2e-3 * mean.g);
  EXPECT_NEAR(kept.b, mean.b, 2e-3 * mean.b);
}

TEST(VertexSampler, LooksTexturesUpAtVertices) {
  Scene scene = shapes::empty_scene();
  Image texture(4, 4);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (Rgb& pixel : texture.pixels) pixel = {uniform(random), uniform(random), uniform(random)};
  scene.texture.push_back(texture);
  scene.material[0].albedo = {0.5f, 1, 1};
  scene.material[0].texture = 0;
  shapes::add_quad(scene, {0, 0, 0}, {0, 0, 1}, {1, 0, 0});
  scene.uv = {{0.1f, 0.2f}, {0.9f, 0.3f}, {0.4f, 0.7f}, {1.6f, -0.2f}};
  const Visibility visibility(scene);
  const VertexSampler sampler(scene, visibility);
  for (std::uint32_t v = 0; v < 4; ++v) {
    const Rgb expected =
        scene.material[0].albedo * sample_texture(texture, static_cast<double>(scene.uv[v][0]),
                                                  static_cast<double>(scene.uv[v][1]));
    EXPECT_EQ(sampler.receiver(v, 0).bsdf.diffuse_reflectance, RgbD(expected));
  }
}

TEST(VertexSampler, FillsTilesByRow) {
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {0, 0, 0}, {1, 1, 1});
  const Visibility visibility(scene);
  const VertexSampler sampler(scene, visibility);
  std::vector<std::uint32_t> outputs(kTileRows, kNoOutput);
  outputs[3] = 7;
  outputs[60] = 2;
  TileReceivers tile;
  tile.coverage.assign(5, 1.0f);
  sampler.sample(outputs, tile);
  ASSERT_EQ(tile.receivers.size(), 2u);
  EXPECT_EQ(tile.receivers[0].row, 3u);
  EXPECT_EQ(tile.receivers[0].bsdf.normal, scene.normal[7]);
  EXPECT_EQ(tile.receivers[1].row, 60u);
  ASSERT_EQ(tile.coverage.size(), static_cast<std::size_t>(kTileRows));
  for (std::size_t row = 0; row < kTileRows; ++row) {
    EXPECT_EQ(tile.coverage[row], row == 3 || row == 60 ? 1.0f : 0.0f);
  }
  EXPECT_TRUE(tile.escapes.empty());
}

}  // namespace
}  // namespace haarlight
