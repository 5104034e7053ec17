// Row 49: one hash on 1, 2, 3 and 8 threads, five times each.

#include <gtest/gtest.h>
#include <xxhash.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "cpca/cluster_relighter.h"
#include "cpca/compress.h"
#include "precompute/precompute.h"
#include "precompute/precompute_mesh.h"
#include "prt/image_relighter.h"
#include "prt/motion.h"
#include "prt/picture_relighter.h"
#include "tests/core/temporary_folder.h"
#include "tests/hard/hard_case.h"
#include "tests/hard/oracle.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

using namespace hard;

class Hash {
 public:
  void add(const void* data, std::size_t bytes) {
    value_ = XXH3_64bits_withSeed(data, bytes, value_);
  }
  void add(const Image& image) { add(image.pixels.data(), image.pixels.size() * sizeof(Rgb)); }
  void add(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    add(bytes.data(), bytes.size());
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

// How many different hashes five runs on each number of threads give.
double hashes_of(const std::function<std::uint64_t()>& run) {
  std::set<std::uint64_t> hashes;
  const int before = thread_count();
  for (const int threads : {1, 2, 3, 8}) {
    set_thread_count(threads);
    for (int i = 0; i < 5; ++i) hashes.insert(run());
  }
  set_thread_count(before);
  return static_cast<double>(hashes.size());
}

Scene still_life() {
  Scene scene = shapes::empty_scene();
  scene.material[0].albedo = {0.6f, 0.5f, 0.4f};
  scene.material.push_back(scene.material[0]);
  scene.material[1].specular = {0.3f, 0.3f, 0.2f};
  shapes::add_quad(scene, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
  shapes::add_sphere(scene, {0.1, 0.8, 0}, 0.4, 3, 1);
  return scene;
}

const Camera kCamera = look_at({0.5, 2, 3}, {0, 0.3, 0}, 0.8, 32, 24);

TEST(HardCases, Row49_ThreadsPrecomputePictures) {
  property("the file of a picture is the same bytes on 1, 2, 3, 8 threads, five times each");
  const Scene scene = still_life();
  for (const int bounces : {0, 2}) {
    PrecomputeOptions options;
    options.trace.face_size = 8;
    options.trace.indirect_face = 8;
    options.trace.paths = 32;
    options.trace.effects.bounces = bounces;
    at_most(fmt::format("hashes, {} bounces", bounces), hashes_of([&] {
              const TemporaryFolder folder;
              precompute_image(scene, kCamera, options, folder / "a.hlt");
              Hash hash;
              hash.add(folder / "a.hlt");
              return hash.value();
            }),
            1);
  }
}

TEST(HardCases, Row49_ThreadsPrecomputeMeshes) {
  property("the file of a mesh, subdivision included, is the same bytes on any number of threads");
  const Scene scene = still_life();
  MeshOptions options;
  options.trace.face_size = 8;
  options.max_vertices = 2000;
  at_most("hashes", hashes_of([&] {
            const TemporaryFolder folder;
            precompute_mesh(scene, kCamera, options, folder / "a.hlt");
            Hash hash;
            hash.add(folder / "a.hlt");
            return hash.value();
          }),
          1);
}

TEST(HardCases, Row49_ThreadsRelightFrames) {
  property("relit frames, light and sums included, are the same bits on any number of threads");
  const fixtures::SmallTransport small = fixtures::small_transport(16, 200, 130, 41);
  const fixtures::SmallTransport vertices =
      fixtures::small_mesh_transport(16, fixtures::bumpy_sphere(3000, 42), 43);
  const Transport transports[] = {
      build_transport(small.info, small.tiles, small.thresholds),
      build_transport(vertices.info, vertices.tiles, vertices.thresholds)};
  Image sky(128, 64);
  std::mt19937 random(44);
  std::uniform_real_distribution<float> uniform(0, 2);
  for (Rgb& p : sky.pixels) p = {uniform(random), uniform(random), uniform(random)};
  sky.at(17, 20) = {1e6f, 1e6f, 1e6f};
  const Environment environment(sky);
  for (const Transport& transport : transports) {
    const bool picture = transport.kind() == TransportKind::image;
    at_most(picture ? "hashes, picture" : "hashes, mesh", hashes_of([&] {
              Motion motion({.kind = MotionKind::tumble, .degrees = 90, .stop = 15},
                            transport.layout(), environment);
              LightingTracker tracker(transport.layout(), {});
              PictureRelighter relighter(transport);
              RowSums sums(transport);  // doubles: what floats would round away shows
              Hash hash;
              for (int frame = 0; frame < 16; ++frame) {
                const LightingUpdate& update = tracker.advance(motion.coefficients(frame));
                relighter.apply(update);
                sums.apply(update);
                hash.add(relighter.picture());
                hash.add(sums.totals().data(), sums.totals().size_bytes());
              }
              return hash.value();
            }),
            1);
  }
}

TEST(HardCases, Row49_ThreadsClusters) {
  property("clustered PCA: the file, and frames relit from it, are the same bits on any threads");
  const fixtures::SmallTransport small =
      fixtures::small_mesh_transport(8, fixtures::bumpy_sphere(400, 45), 46);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  at_most("hashes", hashes_of([&] {
            const TemporaryFolder folder;
            compress_transport(transport, folder / "a.hlt", {.clusters = 9, .basis = 6});
            Hash hash;
            hash.add(folder / "a.hlt");
            ClusterRelighter relighter(Transport::open(folder / "a.hlt"));
            LightingTracker tracker(transport.layout(), {});
            std::mt19937_64 light(47);
            for (int frame = 0; frame < 8; ++frame) {
              const auto target = fixtures::random_lighting(transport.layout(), light);
              relighter.apply(tracker.advance(target));
              hash.add(relighter.picture());
              hash.add(relighter.sums().data(), relighter.sums().size_bytes());
            }
            return hash.value();
          }),
          1);
}

}  // namespace
}  // namespace haarlight
