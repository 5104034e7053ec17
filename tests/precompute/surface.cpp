// What a camera ray meets: place, normals, colour.

#include "precompute/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "precompute/texture.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

TEST(Surface, HitsLieOnTheSphereFacingTheViewer) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0, 0, 0}, 1, 5);  // local radius 1, too
  const Visibility visibility(scene);
  std::mt19937 random(7);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 from = 3 * shapes::random_direction(random);
    const Vec3 to = 0.9 * shapes::random_direction(random);
    const auto hit = surface_hit(scene, visibility, from, normalize(to - from));
    ASSERT_TRUE(hit);
    // Edges are at most sqrt(2) / 2^5 on the octahedron, sqrt(3) times that on the sphere; the
    // middle of a face is edge^2 / 6 below it.
    EXPECT_NEAR(length(hit->position), 1, 1e-3);
    EXPECT_GT(dot(hit->geometric_normal, from - hit->position), 0);
    // Smooth normals differ from the place's direction by the square of half an edge.
    EXPECT_GT(dot(hit->normal, normalize(hit->position)), 1 - 1e-3);
    EXPECT_NEAR(length(hit->position - from), hit->distance, 1e-5);
    EXPECT_NEAR(length(hit->normal), 1, 1e-12);
  }
}

TEST(Surface, BackSidesAreLitFromTheViewersSide) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});  // faces up
  const Visibility visibility(scene);
  const auto below = surface_hit(scene, visibility, {0.1, -1, 0.2}, {0, 1, 0});
  ASSERT_TRUE(below);
  EXPECT_EQ(below->geometric_normal, (Vec3{0, -1, 0}));
  EXPECT_EQ(below->normal, (Vec3{0, -1, 0}));
  EXPECT_FALSE(surface_hit(scene, visibility, {0.1, -1, 0.2}, {0, -1, 0}));
}

TEST(Surface, TextureIsBilinearRepeatsAndStartsAtTheLowerLeft) {
  Image image(2, 2);
  image.at(0, 0) = {1, 0, 0};  // top left
  image.at(1, 0) = {0, 1, 0};
  image.at(0, 1) = {0, 0, 1};  // bottom left
  image.at(1, 1) = {1, 1, 1};
  EXPECT_EQ(sample_texture(image, 0.25, 0.75), (Rgb{1, 0, 0}));
  EXPECT_EQ(sample_texture(image, 0.25, 0.25), (Rgb{0, 0, 1}));
  EXPECT_EQ(sample_texture(image, 3.25, -1.25), (Rgb{1, 0, 0}));
  EXPECT_EQ(sample_texture(image, 0.5, 0.75), (Rgb{0.5f, 0.5f, 0}));
  EXPECT_EQ(sample_texture(image, 0, 0.5), (Rgb{0.5f, 0.5f, 0.5f}));  // across the border
  EXPECT_TRUE(is_finite(sample_texture(image, std::nan(""), INFINITY)));
  EXPECT_TRUE(is_finite(sample_texture(image, 1e30, -1e30)));
}

TEST(Surface, AlbedoIsMaterialTimesTextureTimesTint) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  scene.material[0].albedo = {0.5f, 0.5f, 0.25f};
  scene.material[0].texture = 0;
  scene.texture.emplace_back(1, 1);
  scene.texture[0].pixels[0] = {0.5f, 1, 1};
  scene.tint.assign(4, Rgb{1, 0.5f, 1});
  const Visibility visibility(scene);
  const auto hit = surface_hit(scene, visibility, {0.1, 1, 0.2}, {0, -1, 0});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->albedo.r, 0.25f, 1e-6f);
  EXPECT_NEAR(hit->albedo.g, 0.25f, 1e-6f);
  EXPECT_NEAR(hit->albedo.b, 0.25f, 1e-6f);
}

// A floor facing +Y whose texture's u runs along +X and v along -Z, so that (u, v, normal) is right
// handed; then with u turned round, which mirrors the texture.
TEST(Surface, NormalTexturesTiltTowardsTheirAxes) {
  for (const bool mirrored : {false, true}) {
    Scene scene = shapes::empty_scene();
    shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
    for (std::size_t v = 0; v < 4; ++v) {
      const Vec3& p = scene.position[v];
      scene.uv[v] = {static_cast<float>(mirrored ? -p.x : p.x), static_cast<float>(-p.z)};
    }
    scene.texture.emplace_back(1, 1);
    scene.texture[0].pixels[0] = {0.8f, 0.6f, 1};  // (0.6, 0.2, 1)
    scene.material[0].normal_texture = 0;
    const Vec3 along{mirrored ? -1.0 : 1.0, 0, 0};
    for (const float scale : {1.0f, 0.5f, 0.0f}) {
      scene.material[0].normal_scale = scale;
      const double s = static_cast<double>(scale);
      const Visibility visibility(scene);
      const auto above = surface_hit(scene, visibility, {0.1, 1, 0.2}, {0, -1, 0});
      ASSERT_TRUE(above);
      EXPECT_TRUE(above->outside);
      const Vec3 expected = normalize(0.6 * s * along + 0.2 * s * Vec3{0, 0, -1} + Vec3{0, 1, 0});
      EXPECT_NEAR(length(above->normal - expected), 0, 1e-6);
      // Seen from below it is the same surface with its normal reversed.
      const auto below = surface_hit(scene, visibility, {0.1, -1, 0.2}, {0, 1, 0});
      ASSERT_TRUE(below);
      EXPECT_FALSE(below->outside);
      EXPECT_NEAR(length(below->normal + expected), 0, 1e-6);
    }
    // Without area in the texture there is no frame: the normal stays.
    scene.material[0].normal_scale = 1;
    scene.uv.assign(4, {0.5f, 0.5f});
    const Visibility visibility(scene);
    EXPECT_EQ(surface_hit(scene, visibility, {0.1, 1, 0.2}, {0, -1, 0})->normal, (Vec3{0, 1, 0}));
  }
}

// However steep the bumps, the viewer and the true surface stay above the normal's horizon.
TEST(Surface, NormalsFaceTheViewer) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0, 0, 0}, 1, 3);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  for (auto& uv : scene.uv) uv = {4 * unit(random), 4 * unit(random)};
  scene.texture.emplace_back(8, 8);
  for (Rgb& p : scene.texture[0].pixels) p = {unit(random), unit(random), unit(random)};
  scene.material[0].normal_texture = 0;
  scene.material[0].normal_scale = 3;
  const Visibility visibility(scene);
  int bent = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 from = 3 * shapes::random_direction(random);
    const Vec3 to = 0.95 * shapes::random_direction(random);
    const auto hit = surface_hit(scene, visibility, from, normalize(to - from));
    ASSERT_TRUE(hit);
    ASSERT_NEAR(length(hit->normal), 1, 1e-12);
    ASSERT_GT(dot(hit->normal, hit->to_viewer), 0);
    ASSERT_GT(dot(hit->normal, hit->geometric_normal), 0);
    bent += dot(hit->normal, hit->to_viewer) < 1.1e-3;
  }
  EXPECT_GT(bent, 50);  // the test is about something
}

TEST(Surface, MetalAndRoughnessAreTimesTheirTexture) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  Material& m = scene.material[0];
  m.model = SurfaceModel::metallic_roughness;
  m.metallic = 0.5f, m.roughness = 0.75f;
  const auto hit = [&] {
    const Visibility visibility(scene);
    return *surface_hit(scene, visibility, {0.1, 1, 0.2}, {0, -1, 0});
  };
  EXPECT_EQ(hit().metallic, 0.5f);
  EXPECT_EQ(hit().roughness, 0.75f);
  scene.texture.emplace_back(1, 1);
  scene.texture[0].pixels[0] = {0.9f, 0.5f, 0.25f};
  m.metallic_roughness_texture = 0;
  EXPECT_EQ(hit().metallic, 0.125f);
  EXPECT_EQ(hit().roughness, 0.375f);
}

}  // namespace
}  // namespace haarlight
