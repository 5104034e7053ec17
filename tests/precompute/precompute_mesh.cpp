// The driver for meshes: the same bytes however it is made, and a picture that agrees with that of
// the fixed view.

#include "precompute/precompute_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/image_relighter.h"
#include "prt/picture_relighter.h"
#include "prt/prior_lighting.h"
#include "prt/transport.h"
#include "tests/core/temporary_folder.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Scene ball_over_ground() {
  Scene scene = shapes::empty_scene();
  scene.material[0].albedo = {0.6f, 0.5f, 0.4f};
  shapes::add_quad(scene, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
  shapes::add_sphere(scene, {0.1, 0.8, 0}, 0.4, 4);
  return scene;
}

MeshOptions small_options() {
  MeshOptions options;
  options.trace.face_size = 8;
  options.max_vertices = 6000;
  return options;
}

const Camera kCamera = look_at({0.5, 2, 3}, {0, 0.3, 0}, 0.8, 48, 40);

TEST(PrecomputeMesh, OneAndSevenThreadsAndAResumedRunGiveTheSameBytes) {
  const TemporaryFolder folder;
  const Scene scene = ball_over_ground();
  const MeshOptions options = small_options();
  const int before = thread_count();
  set_thread_count(1);
  const MeshReport one = precompute_mesh(scene, kCamera, options, folder / "one.hlt");
  set_thread_count(7);
  const MeshReport seven = precompute_mesh(scene, kCamera, options, folder / "seven.hlt");
  set_thread_count(before);
  EXPECT_EQ(bytes_of(folder / "one.hlt"), bytes_of(folder / "seven.hlt"));
  EXPECT_EQ(one.run.rays, seven.run.rays);
  EXPECT_EQ(one.run.tiles, (one.subdivision.vertices + 63) / 64);

  // Stopped well into tracing, then resumed.
  MeshOptions resumed = options;
  resumed.resume = true;
  const MeshReport cut = precompute_mesh(scene, kCamera, options, folder / "cut.hlt",
                                         [](double share) { return share < 0.8; });
  EXPECT_EQ(cut.run.end, RunEnd::stopped);
  EXPECT_FALSE(cut.run.complete);
  EXPECT_EQ(Transport::open(folder / "cut.hlt").kind(), TransportKind::mesh);
  const MeshReport rest = precompute_mesh(scene, kCamera, resumed, folder / "cut.hlt");
  EXPECT_GT(rest.run.resumed_tiles, 0);
  EXPECT_LT(rest.run.resumed_tiles, rest.run.tiles);
  EXPECT_TRUE(rest.run.complete);
  EXPECT_EQ(bytes_of(folder / "cut.hlt"), bytes_of(folder / "one.hlt"));
}

TEST(PrecomputeMesh, FileHoldsTheMeshItWasTracedFor) {
  const TemporaryFolder folder;
  const Scene scene = ball_over_ground();
  MeshOptions options = small_options();
  options.subdivide = false;
  const MeshReport report = precompute_mesh(scene, kCamera, options, folder / "a.hlt");
  const Transport transport = Transport::open(folder / "a.hlt");
  ASSERT_EQ(transport.kind(), TransportKind::mesh);
  const TransportMesh& mesh = *transport.info().mesh;
  ASSERT_EQ(mesh.position.size(), scene.position.size());
  EXPECT_EQ(report.subdivision.vertices, static_cast<std::int64_t>(scene.position.size()));
  EXPECT_EQ(report.subdivision.split_edges, 0);
  ASSERT_EQ(mesh.triangle.size(), scene.triangle.size());
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    // Half an ulp of coordinates below 4, from an origin that is exact.
    EXPECT_LT(length(mesh.world(v) - scene.position[v]), 3 * 4 * 0x1p-24);
  }
  EXPECT_EQ(transport.info().camera.position, kCamera.position);
  EXPECT_EQ(transport.width(), kCamera.width);
  for (const char* text : {"max_vertices", "measured_error", "view_dependent_vertices"}) {
    EXPECT_NE(transport.info().meta.find(text), std::string::npos) << text;
  }
  EXPECT_NE(mesh_fingerprint(scene, kCamera, options),
            mesh_fingerprint(scene, kCamera, small_options()));
}

// An open convex body under an even sky of radiance 1 shows its albedo, whatever the compression:
// each row's sum is the cosine's integral, to what compression may cost.
TEST(PrecomputeMesh, AConvexBodyUnderAnEvenSkyShowsItsAlbedo) {
  const TemporaryFolder folder;
  Scene scene = shapes::empty_scene();
  scene.material[0].albedo = {0.6f, 0.5f, 0.4f};
  shapes::add_sphere(scene, {3, 1, 0}, 0.5, 4);
  MeshOptions options = small_options();
  options.error = 0;
  precompute_mesh(scene, kCamera, options, folder / "a.hlt");
  const Transport transport = Transport::open(folder / "a.hlt");
  std::vector<Rgb> texels(6 * 8 * 8, Rgb{1, 1, 1}), lighting(texels.size());
  haar_forward(transport.layout(), std::span<const Rgb>(texels), std::span<Rgb>(lighting));
  const Camera camera = look_at({3, 1, 2}, {3, 1, 0}, 0.7, 32, 32);
  const Image picture = relight_picture_once(transport, lighting, camera);
  // The middle of the picture; 8 bits a value and 4 directions a texel along the horizon.
  EXPECT_NEAR(static_cast<double>(picture.at(16, 16).r), 0.6, 0.6 * 0.01);
  EXPECT_NEAR(static_cast<double>(picture.at(16, 16).g), 0.5, 0.5 * 0.01);
  EXPECT_NEAR(static_cast<double>(picture.at(16, 16).b), 0.4, 0.4 * 0.01);
}

// The mesh looked at from the fixed view's camera shows what the fixed view does. They differ by
// interpolation between vertices where shadows end, less so the finer the mesh is, and by both
// compressions (1 % each).
TEST(PrecomputeMesh, AgreesWithTheFixedView) {
  const TemporaryFolder folder;
  const Scene scene = ball_over_ground();
  MeshOptions options = small_options();
  precompute_image(scene, kCamera, options, folder / "image.hlt");
  precompute_mesh(scene, kCamera, options, folder / "fine.hlt");
  options.subdivide = false;
  precompute_mesh(scene, kCamera, options, folder / "coarse.hlt");
  const Transport image = Transport::open(folder / "image.hlt");
  const Transport fine = Transport::open(folder / "fine.hlt");
  const Transport coarse = Transport::open(folder / "coarse.hlt");
  for (const std::vector<float>& grey : prior_lightings(image.layout())) {
    std::vector<Rgb> lighting;
    for (const float l : grey) lighting.push_back({l, l, l});
    const Image expected = relight_once(image, lighting);
    // Pixels wholly covered in both: at the rims samples lie in other places.
    const auto error = [&](const Transport& mesh) {
      PictureRelighter relighter(mesh);
      const Image picture = relight_picture_once(mesh, lighting, kCamera);
      double difference = 0, power = 0;
      for (std::size_t p = 0; p < picture.pixels.size(); ++p) {
        if (image.coverage()[p] < 1) continue;
        const RgbD a(picture.pixels[p]), b(expected.pixels[p]), d = a - b;
        difference += d.r * d.r + d.g * d.g + d.b * d.b;
        power += b.r * b.r + b.g * b.g + b.b * b.b;
      }
      return std::sqrt(difference / power);
    };
    const double with = error(fine), without = error(coarse);
    EXPECT_LT(with, 0.08);
    EXPECT_LT(with, 0.6 * without);
  }
}

TEST(PrecomputeMesh, RefusesWhatThePictureDoes) {
  const TemporaryFolder folder;
  const Scene scene = ball_over_ground();
  MeshOptions options = small_options();
  options.error = 2;
  EXPECT_THROW(precompute_mesh(scene, kCamera, options, folder / "a.hlt"), Error);
  options = small_options();
  options.trace.face_size = 5;
  EXPECT_THROW(precompute_mesh(scene, kCamera, options, folder / "a.hlt"), Error);
  options = small_options();
  EXPECT_THROW(precompute_mesh(scene, kCamera, options, folder / "none" / "a.hlt"), Error);
  EXPECT_THROW(precompute_mesh(shapes::empty_scene(), kCamera, options, folder / "a.hlt"), Error);
}

}  // namespace
}  // namespace haarlight
