// Meshes relit: radiance == T * shown after every update, and pictures of it.

#include "prt/mesh_relighter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/image_metrics.h"
#include "core/parallel.h"
#include "prt/image_relighter.h"
#include "prt/lighting_tracker.h"
#include "prt/mesh_picture.h"
#include "prt/picture_relighter.h"
#include "prt/relight_sequence.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using fixtures::product;
using fixtures::SmallTransport;

Environment random_environment(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  Image picture(32, 16);
  for (Rgb& pixel : picture.pixels) pixel = {uniform(random), uniform(random), uniform(random)};
  picture.at(20, 5) = {40, 30, 20};
  return Environment(picture);
}

TEST(MeshRelighter, RadianceEqualsTransportTimesShownForEveryMethod) {
  for (const int terms : {1, 3}) {
    const SmallTransport small =
        fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(130, 1), 1, terms);
    const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
    const std::vector<double> dense = fixtures::dense(small);
    const HaarLayout& layout = transport.layout();
    for (const auto method : {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
      std::mt19937_64 random(2);
      LightingOptions options;
      options.method = method;
      options.wavelets = 25;
      LightingTracker tracker(layout, options);
      MeshRelighter relighter(transport);
      ASSERT_EQ(relighter.radiance().size(), small.info.output_count());
      for (int frame = 0; frame < 12; ++frame) {
        const auto target =
            frame == 7 ? std::vector<Rgb>(96) : fixtures::random_lighting(layout, random);
        relighter.apply(frame == 0 ? tracker.start_exact(target) : tracker.advance(target));
        const auto expected = product(dense, tracker.shown());
        // Sums in double: bound A of docs/method.md with S <= 96 x 0.1 x 100 is below 1e-9. Two
        // roundings to float on top.
        for (std::size_t o = 0; o < expected.size(); ++o) {
          const RgbD shown(relighter.radiance()[o]);
          const auto close = [](double a, double b) {
            return std::abs(a - b) <= 1e-9 + 2.5 * 0x1p-24 * std::abs(b);
          };
          ASSERT_TRUE(close(shown.r, expected[o].r) && close(shown.g, expected[o].g) &&
                      close(shown.b, expected[o].b))
              << "output " << o << " in frame " << frame;
        }
      }
    }
  }
}

TEST(MeshRelighter, KindsAreNotMixedUp) {
  const SmallTransport mesh = fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(60, 3), 3);
  const SmallTransport image = fixtures::small_transport(4, 16, 16, 3);
  const Transport of_mesh = build_transport(mesh.info, mesh.tiles, mesh.thresholds);
  const Transport of_image = build_transport(image.info, image.tiles, image.thresholds);
  EXPECT_THROW(MeshRelighter{of_image}, Error);
  EXPECT_THROW(ImageRelighter{of_mesh}, Error);
  EXPECT_THROW(relight_once(of_mesh, std::vector<Rgb>(96)), Error);
  const SmallTransport terms =
      fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(60, 3), 3, 2);
  EXPECT_THROW(PictureRelighter{build_transport(terms.info, terms.tiles, terms.thresholds)}, Error);
  SequenceOptions orbit;
  orbit.orbit_degrees = 10;
  EXPECT_THROW(sequence_camera(of_image, orbit, 0), Error);
  PictureRelighter fixed(of_image);
  EXPECT_NO_THROW(fixed.set_camera(image.info.camera));
  Camera other = image.info.camera;
  other.position.x += 1;
  EXPECT_THROW(fixed.set_camera(other), Error);
}

TEST(MeshRelighter, SequencesShowTheDrawnRadianceOnTheOrbit) {
  const SmallTransport small = fixtures::small_mesh_transport(8, fixtures::bumpy_sphere(300, 4), 4);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const std::vector<double> dense = fixtures::dense(small);
  const Environment light = random_environment(4);
  SequenceOptions options;
  options.lighting.wavelets = 30;
  options.motion.stop = 6;
  options.frames = 9;
  options.orbit_degrees = 180;
  options.width = 40, options.height = 30;
  options.against_reference = true;
  const BoundingSphere sphere = bounding_sphere(*small.info.mesh);
  MeshPicture drawing(small.info.mesh);
  LightingOptions lighting = options.lighting;
  lighting.weights = wavelet_weights(options.weight, transport);
  LightingTracker tracker(transport.layout(), lighting);
  int frames = 0;
  std::vector<Rgb> first;
  relight_sequence(transport, light, nullptr, options, [&](const SequenceFrame& frame) {
    if (frames == 0) {
      tracker.start_exact(frame.target);
      first = frame.picture.pixels;
    } else {
      tracker.advance(frame.target);
    }
    EXPECT_EQ(frame.picture.width, 40);
    EXPECT_EQ(frame.picture.height, 30);
    // The camera: on its circle, its middle ray through the mesh's middle as at first.
    const double t = std::min(frames, 6) / 6.0;
    const Vec3 start = small.info.camera.position - sphere.center;
    const Vec3 now = frame.view.camera.position - sphere.center;
    EXPECT_NEAR(now.y, start.y, 1e-12);
    EXPECT_NEAR(now.x, start.x * std::cos(kPi * t) + start.z * std::sin(kPi * t), 1e-12);
    EXPECT_NEAR(now.z, start.z * std::cos(kPi * t) - start.x * std::sin(kPi * t), 1e-12);
    const Vec3 ray = frame.view.camera.direction(20, 15);
    EXPECT_NEAR(dot(ray, normalize(sphere.center - frame.view.camera.position)), 1, 1e-12);

    drawing.look(frame.view.camera);
    EXPECT_TRUE(std::ranges::equal(frame.view.coverage, drawing.coverage()));
    const auto draw = [&](std::span<const Rgb> shown) {
      std::vector<Rgb> radiance;
      for (const RgbD& r : product(dense, shown)) radiance.push_back(Rgb(r));
      Image image;
      drawing.shade(radiance, image);
      return image;
    };
    const Image expected = draw(tracker.shown()), exact = draw(frame.target);
    float most = 0;
    for (std::size_t p = 0; p < expected.pixels.size(); ++p) {
      most = std::max(most, l1_norm(frame.picture.pixels[p] - expected.pixels[p]));
    }
    EXPECT_LT(most, 1e-5f);  // values up to about 30, floats: see the test above
    EXPECT_NEAR(*frame.metrics.image_rel_rmse, compare_images(expected, exact).relative_rmse, 1e-6);
    ++frames;
    return true;
  });
  EXPECT_EQ(frames, 9);
}

TEST(MeshRelighter, TheCameraMovesWithoutTouchingTransport) {
  const SmallTransport small = fixtures::small_mesh_transport(8, fixtures::bumpy_sphere(300, 5), 5);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const Environment light = random_environment(5);
  SequenceOptions options;
  options.motion.kind = MotionKind::still;
  options.motion.stop = 10;
  options.frames = 12;
  options.orbit_degrees = 90;
  std::vector<std::vector<Rgb>> pictures;
  relight_sequence(transport, light, nullptr, options, [&](const SequenceFrame& frame) {
    if (frame.metrics.frame > 0) {
      EXPECT_EQ(frame.metrics.updates, 0);
      EXPECT_EQ(frame.metrics.bytes, 0u);
    }
    pictures.push_back(frame.picture.pixels);
    const Image once = relight_picture_once(transport, frame.target, frame.view.camera);
    for (std::size_t p = 0; p < once.pixels.size(); ++p) {
      EXPECT_LT(l1_norm(once.pixels[p] - frame.picture.pixels[p]), 1e-5f);
    }
    return true;
  });
  EXPECT_NE(pictures[0], pictures[5]);
  EXPECT_NE(pictures[9], pictures[10]);
  EXPECT_EQ(pictures[10], pictures[11]);  // past `stop` the camera rests
}

TEST(MeshRelighter, TheSameBitsOnAnyNumberOfThreads) {
  const SmallTransport small =
      fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(5000, 6), 6);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const Environment light = random_environment(6);
  SequenceOptions options;
  options.motion.stop = 4;
  options.frames = 5;
  options.orbit_degrees = 30;
  const int before = thread_count();
  std::vector<std::vector<Rgb>> pictures[2];
  for (int run = 0; run < 2; ++run) {
    set_thread_count(run == 0 ? 1 : 7);
    relight_sequence(transport, light, nullptr, options, [&](const SequenceFrame& frame) {
      pictures[run].push_back(frame.picture.pixels);
      return true;
    });
  }
  set_thread_count(before);
  EXPECT_EQ(pictures[0], pictures[1]);
}

}  // namespace
}  // namespace haarlight
