// The driver: one file, the same bytes however it is made, and clean failures.

#include "precompute/precompute.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/transport.h"
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

TEST_F(PrecomputeImage, StoppedAndResumedGivesTheSameBytes) {
  make("whole.hlt");
  int calls = 0;
  EXPECT_EQ(kind_of([&] {
              make("parts.hlt", [&](double share) { return ++calls < 20 || share > 0.99; });
            }),
            ErrorKind::cancelled);
  EXPECT_FALSE(fs::exists(file("parts.hlt")));
  options_.resume = true;
  const PrecomputeReport report = make("parts.hlt");
  EXPECT_GT(report.resumed_tiles, 0);
  EXPECT_LT(report.resumed_tiles, report.tiles);
  EXPECT_TRUE(bytes(file("parts.hlt")) == bytes(file("whole.hlt")));
}

TEST_F(PrecomputeImage, JournalOfOtherInputIsNotContinued) {
  int calls = 0;
  EXPECT_EQ(kind_of([&] { make("a.hlt", [&](double) { return ++calls < 20; }); }),
            ErrorKind::cancelled);
  options_.resume = true;
  scene_.material[0].albedo = {0.1f, 0.1f, 0.1f};
  EXPECT_EQ(make("a.hlt").resumed_tiles, 0);
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
