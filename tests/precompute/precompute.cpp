// The driver: one file, the same bytes however it is made, and clean failures.

#include "precompute/precompute.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "precompute/memory_budget.h"
#include "precompute/picture_tiles.h"
#include "prt/image_relighter.h"
#include "prt/transport.h"
#include "prt/transport_merge.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;

class PrecomputeImage : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        ("haarlight-" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) +
         std::to_string(::getpid()));
    fs::create_directories(folder_);
    threads_ = thread_count();
    scene_ = shapes::empty_scene();
    scene_.material[0].albedo = {0.6f, 0.5f, 0.4f};
    shapes::add_quad(scene_, {-3, 0, -3}, {0, 0, 6}, {6, 0, 0});
    shapes::add_sphere(scene_, {0, 0.5, 0}, 0.5, 3);
    camera_ = look_at({0.5, 1.5, 3}, {0, 0.3, 0}, 0.8, 40, 28);
    options_.trace.face_size = 16;
  }
  void TearDown() override {
    set_thread_count(threads_);
    fs::remove_all(folder_);
  }
  fs::path file(const std::string& name) const { return folder_ / name; }
  static std::string bytes(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  PrecomputeReport make(const std::string& name, const Progress& progress = {}) const {
    return precompute_image(scene_, camera_, options_, file(name), progress);
  }

  fs::path folder_;
  int threads_ = 1;
  Scene scene_;
  Camera camera_;
  PrecomputeOptions options_;
};

ErrorKind kind_of(const std::function<void()>& call, std::string* message = nullptr) {
  try {
    call();
  } catch (const Error& error) {
    if (message) *message = error.what();
    return error.kind();
  }
  ADD_FAILURE() << "expected an error";
  return ErrorKind::io;
}

TEST_F(PrecomputeImage, OneAndSevenThreadsGiveTheSameBytes) {
  set_thread_count(1);
  const PrecomputeReport one = make("one.hlt");
  set_thread_count(7);
  const PrecomputeReport seven = make("seven.hlt");
  const std::string expected = bytes(file("one.hlt"));
  EXPECT_FALSE(expected.empty());
  EXPECT_TRUE(bytes(file("seven.hlt")) == expected);
  EXPECT_EQ(one.rays, seven.rays);
  EXPECT_EQ(one.bytes, expected.size());
  EXPECT_EQ(one.tiles, 5 * 4);  // 40 x 28 pixels in tiles of 8 x 8
  EXPECT_EQ(one.rgb_blocks, 0);
  EXPECT_GT(one.blocks, 0);
  EXPECT_LE(one.measured_error, options_.error * 1.05);
  EXPECT_GT(one.seconds, 0);
}

TEST_F(PrecomputeImage, FileKnowsItsSceneOptionsAndCoverage) {
  make("a.hlt");
  const Transport transport = Transport::open(file("a.hlt"));
  EXPECT_EQ(transport.width(), 40);
  EXPECT_EQ(transport.height(), 28);
  EXPECT_EQ(transport.info().face_size, 16);
  EXPECT_EQ(transport.info().camera.position, camera_.position);
  for (const char* text : {"\"test\"", "\"spp\"", "\"measured_error\"", "\"triangles\""}) {
    EXPECT_NE(transport.info().meta.find(text), std::string::npos) << text;
  }
  // The middle of the picture shows the ball, the top corners the sky.
  EXPECT_EQ(transport.coverage()[14 * 40 + 20], 1.0f);
  EXPECT_EQ(transport.coverage()[0], 0.0f);
}

// The picture of a transport under a sky of radiance 1, one channel a pixel.
std::vector<double> white_picture(const fs::path& path) {
  const Transport transport = Transport::open(path);
  std::vector<Rgb> sky(static_cast<std::size_t>(transport.layout().size()));
  for (int face = 0; face < 6; ++face) {  // only scaling coefficients: a constant
    sky[static_cast<std::size_t>(face)] =
        Rgb{1, 1, 1} * static_cast<float>(transport.info().face_size);
  }
  const Image picture = relight_once(transport, sky);
  std::vector<double> green;
  for (const Rgb& p : picture.pixels) green.push_back(static_cast<double>(p.g));
  return green;
}

TEST_F(PrecomputeImage, StoppedLeavesAPreviewAndResumesToTheSameBytes) {
  make("whole.hlt");
  // Pilots first (20 tiles, so 20 steps): then a few tiles.
  const auto stopped = make("parts.hlt", [&](double share) { return share < 0.85; });
  EXPECT_EQ(stopped.end, RunEnd::stopped);
  EXPECT_FALSE(stopped.complete);
  EXPECT_GT(stopped.tiles_traced, 0);
  EXPECT_LT(stopped.tiles_traced, stopped.tiles);
  const std::string meta = Transport::open(file("parts.hlt")).info().meta;
  EXPECT_NE(meta.find("\"complete\": false"), std::string::npos) << meta;
  EXPECT_NE(meta.find(fmt::format("\"tiles_traced\": {}", stopped.tiles_traced)),
            std::string::npos);
  // One row a block stands for 16: a coarse picture, but the right one in the mean.
  const std::vector<double> right = white_picture(file("whole.hlt"));
  const std::vector<double> coarse = white_picture(file("parts.hlt"));
  double sum[2] = {0, 0}, difference = 0;
  for (std::size_t i = 0; i < right.size(); ++i) {
    sum[0] += right[i];
    sum[1] += coarse[i];
    difference += std::abs(right[i] - coarse[i]);
  }
  EXPECT_GT(difference, 0);
  EXPECT_LT(difference, 0.25 * sum[0]);
  EXPECT_NEAR(sum[1], sum[0], 0.1 * sum[0]);

  options_.resume = true;
  const PrecomputeReport report = make("parts.hlt");
  EXPECT_EQ(report.resumed_tiles, stopped.tiles_traced);
  EXPECT_TRUE(report.complete);
  EXPECT_TRUE(bytes(file("parts.hlt")) == bytes(file("whole.hlt")));
  EXPECT_FALSE(fs::exists(file("parts.hlt.partial")));
}

TEST_F(PrecomputeImage, APreviewDoesNotReplaceAWholeFile) {
  make("a.hlt");
  const std::string before = bytes(file("a.hlt"));
  options_.error = 0.02;
  const PrecomputeReport report = make("a.hlt", [&](double share) { return share < 0.85; });
  EXPECT_EQ(report.end, RunEnd::stopped);
  EXPECT_EQ(report.bytes, 0u);
  EXPECT_TRUE(bytes(file("a.hlt")) == before);
  EXPECT_TRUE(fs::exists(file("a.hlt.partial")));
  // At the very beginning too, where there is nothing to keep but a glance.
  options_.error = 0.03;
  make("a.hlt", [](double) { return false; });
  EXPECT_TRUE(bytes(file("a.hlt")) == before);
  const PrecomputeReport early = make("b.hlt", [](double) { return false; });
  EXPECT_EQ(early.tiles_traced, 0);
  EXPECT_GT(early.bytes, 0u);
  EXPECT_EQ(Transport::open(file("b.hlt")).coverage()[14 * 40 + 20], 1.0f);
}

TEST_F(PrecomputeImage, TimeLimitIsKept) {
  // Dear tiles enough for a second or more, so that pilots are a small part.
  options_.trace.spp = 3;
  options_.trace.adaptive = false;
  options_.trace.pixel_samples = 1;
  camera_ = look_at({0.5, 1.5, 3}, {0, 0.3, 0}, 0.8, 160, 160);
  const double whole = make("whole.hlt").seconds;
  options_.time_limit = 0.5 * whole;
  const PrecomputeReport report = make("limited.hlt");
  EXPECT_EQ(report.end, RunEnd::time_limit);
  EXPECT_FALSE(report.complete);
  EXPECT_GT(report.bytes, 0u);
  // Half a second for a machine that does other things too.
  EXPECT_LT(report.seconds, options_.time_limit + 0.5);
  options_.time_limit = 0;
  options_.resume = true;
  make("limited.hlt");
  EXPECT_TRUE(bytes(file("limited.hlt")) == bytes(file("whole.hlt")));
}

TEST_F(PrecomputeImage, SizeLimitIsKept) {
  const PrecomputeReport free = make("free.hlt");
  EXPECT_FALSE(free.limited_by_size);
  double last = free.measured_error;
  for (const double part : {0.8, 0.5}) {
    // Between what tables and indices need, at least, and what all of it took.
    const std::uint64_t least = transport_overhead_bytes(Transport::open(file("free.hlt")).info());
    options_.max_bytes =
        std::max(least, static_cast<std::uint64_t>(part * static_cast<double>(free.bytes)));
    const PrecomputeReport limited = make("limited.hlt");
    EXPECT_LE(limited.bytes, options_.max_bytes);
    EXPECT_TRUE(limited.limited_by_size);
    EXPECT_GE(limited.measured_error, last);
    last = limited.measured_error;
  }
  options_.max_bytes = 1000;
  std::string message;
  EXPECT_EQ(kind_of([&] { make("tiny.hlt"); }, &message), ErrorKind::invalid_argument);
  EXPECT_NE(message.find("1000 bytes"), std::string::npos) << message;
}

TEST_F(PrecomputeImage, ShardsJoinToTheBytesOfOneRun) {
  make("whole.hlt");
  std::vector<fs::path> shards;
  for (int i = 1; i <= 3; ++i) {
    options_.shard = {i, 3};
    const PrecomputeReport report = make("joined.hlt");
    EXPECT_TRUE(report.complete);
    EXPECT_EQ(report.bytes, 0u);
    shards.push_back(journal_path(file("joined.hlt"), options_.shard));
  }
  EXPECT_FALSE(fs::exists(file("joined.hlt")));
  std::swap(shards[0], shards[2]);
  EXPECT_TRUE(merge_transport(file("joined.hlt"), shards).complete);
  EXPECT_TRUE(bytes(file("joined.hlt")) == bytes(file("whole.hlt")));

  const auto refused = [&](const std::vector<fs::path>& given, const std::string& words) {
    std::string message;
    kind_of([&] { merge_transport(file("joined.hlt"), given); }, &message);
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  refused({shards[0], shards[1]}, "shard 1 of 3 was not given");
  refused({shards[0], shards[1], shards[1]}, "shard-2-of-3: is shard 2 of 3, as is");
  options_.error = 0.02;
  options_.shard = {1, 3};
  make("other.hlt");
  refused({shards[0], shards[1], journal_path(file("other.hlt"), options_.shard)},
          "other.hlt.shard-1-of-3: was made from another");
  std::ofstream(file("text")) << "no shard";
  refused({file("text")}, "text: ");
  fs::resize_file(shards[1], fs::file_size(shards[1]) - 1);
  refused(shards, "shard-2-of-3: 1 of its 7 tiles are still to be traced");
}

TEST_F(PrecomputeImage, JournalOfOtherInputIsNotContinued) {
  make("a.hlt", [&](double share) { return share < 0.85; });
  options_.resume = true;
  scene_.material[0].albedo = {0.1f, 0.1f, 0.1f};
  EXPECT_EQ(make("a.hlt").resumed_tiles, 0);
}

TEST_F(PrecomputeImage, MemoryLimitsTheWorkers) {
  set_thread_count(7);
  // Room for the process as it is and two workers and a half.
  const HaarLayout layout(options_.trace.face_size);
  const Visibility visibility(scene_);
  const PictureTiles tiles(scene_, visibility, camera_, options_.trace);
  options_.memory = used_memory() + 5 * tiles.worker_bytes() / 2;
  const PrecomputeReport report = make("a.hlt");
  EXPECT_GE(report.workers, 1);
  EXPECT_LE(report.workers, 3);  // a page more or less may be in use by then
  options_.memory = 1 << 20;
  std::string message;
  EXPECT_EQ(kind_of([&] { make("b.hlt"); }, &message), ErrorKind::invalid_argument);
  EXPECT_NE(message.find("memory of 1 MiB"), std::string::npos) << message;
}

TEST_F(PrecomputeImage, FingerprintSeesEverythingThatMatters) {
  const auto print = [&] { return precompute_fingerprint(scene_, camera_, options_); };
  const std::string first = print();
  EXPECT_EQ(first, print());
  std::vector<std::function<void()>> changes{
      [&] { scene_.position[3].x += 1e-12; },
      [&] { scene_.normal[3].y = -scene_.normal[3].y; },
      [&] { scene_.triangle.pop_back(); },
      [&] { scene_.material[0].exponent = 7; },
      [&] {
        scene_.tint.assign(scene_.position.size(), Rgb{1, 1, 1});
      },
      [&] { scene_.texture.emplace_back(2, 1); },
      [&] { scene_.alpha.resize(1); },
      [&] {
        scene_.alpha[0] = {1, 0.5f};
      },
      [&] { scene_.alpha[0][1] = 0.25f; },
      [&] { scene_.material[0].model = SurfaceModel::glass; },
      [&] { scene_.material[0].ior = 1.3f; },
      [&] { scene_.material[0].extinction.g = 2; },
      [&] { scene_.material[0].thin = true; },
      [&] { scene_.material[0].metallic = 0.5f; },
      [&] { scene_.material[0].roughness = 0.5f; },
      [&] { scene_.material[0].metallic_roughness_texture = 0; },
      [&] { scene_.material[0].transmission = 0.5f; },
      [&] { scene_.material[0].normal_texture = 0; },
      [&] { scene_.material[0].normal_scale = 2; },
      [&] { scene_.material[0].alpha_cutoff = 0.5f; },
      [&] { camera_.position.z += 1e-12; },
      [&] { camera_.width += 1; },
      [&] { options_.trace.spp = 5; },
      [&] { options_.trace.adaptive = false; },
      [&] { options_.error = 0.011; },
      [&] { options_.max_bytes = 1 << 30; },
  };
  std::string last = first;
  for (std::size_t i = 0; i < changes.size(); ++i) {
    changes[i]();
    const std::string next = print();
    EXPECT_NE(next, last) << "change " << i;
    last = next;
  }
  options_.resume = true;  // how, not what
  EXPECT_EQ(print(), last);
}

TEST_F(PrecomputeImage, ProgressRisesToOne) {
  double last = 0;
  make("a.hlt", [&](double share) {
    EXPECT_GE(share, last);
    last = share;
    return true;
  });
  EXPECT_EQ(last, 1.0);
}

TEST_F(PrecomputeImage, NothingInViewStillMakesAFile) {
  camera_ = look_at({0, 5, 0}, {0, 9, 0.1}, 0.8, 16, 16);
  const PrecomputeReport report = make("sky.hlt");
  EXPECT_EQ(report.blocks, 0);
  const Transport transport = Transport::open(file("sky.hlt"));
  for (const float c : transport.coverage()) EXPECT_EQ(c, 0.0f);
}

TEST_F(PrecomputeImage, RefusesWhatItCannotDoAndLeavesWhatWasThere) {
  std::ofstream(file("old.hlt")) << "precious";
  const auto refused = [&](const std::string& word) {
    std::string message;
    EXPECT_EQ(kind_of([&] { make("old.hlt"); }, &message), ErrorKind::invalid_argument);
    EXPECT_NE(message.find(word), std::string::npos) << message;
    EXPECT_EQ(bytes(file("old.hlt")), "precious");
    options_ = {};
  };
  options_.trace.face_size = 48;
  refused("48");
  options_.error = 1;
  refused("error is 1");
  options_.error = std::nan("");
  refused("error");
  camera_.vertical_fov = 4;
  refused("field of view");
  camera_.vertical_fov = 0.8;
  camera_.position.y = std::nan("");
  refused("finite");
  camera_.position.y = 1.5;
  camera_.width = 0;
  refused("0x28");
  camera_.width = 40;

  std::string message;
  EXPECT_EQ(kind_of([&] { make("no/such/folder.hlt"); }, &message), ErrorKind::io);
  EXPECT_NE(message.find("folder.hlt"), std::string::npos);
  EXPECT_EQ(kind_of([&] { make("."); }), ErrorKind::io);
  scene_.triangle.clear();
  EXPECT_EQ(kind_of([&] { make("old.hlt"); }), ErrorKind::missing);
  EXPECT_EQ(bytes(file("old.hlt")), "precious");
}

}  // namespace
}  // namespace haarlight
