// Frames from another thread: the newest, never torn, and failures as notices.

#include "viewer/worker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "prt/image_relighter.h"
#include "tests/viewer/inputs.h"
#include "viewer/triple_buffer.h"

namespace haarlight::viewer {
namespace {

using fixtures::TemporaryFolder;

TEST(TripleBuffer, GivesTheNewestWholeValue) {
  using Block = std::array<int, 4096>;
  constexpr int kLast = 20000;
  TripleBuffer<Block> buffer;
  std::thread writer([&] {
    for (int i = 1; i <= kLast; ++i) {
      buffer.back().fill(i);
      buffer.publish();
    }
  });
  int before = 0, seen = 0;
  while (before < kLast) {
    if (!buffer.update()) {
      std::this_thread::yield();
      continue;
    }
    const Block& block = buffer.front();
    ASSERT_TRUE(std::all_of(block.begin(), block.end(), [&](int v) { return v == block[0]; }));
    ASSERT_GT(block[0], before);
    before = block[0];
    ++seen;
  }
  writer.join();
  EXPECT_FALSE(buffer.update());
  EXPECT_GT(seen, 0);
}

bool wait_for(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

struct Running {
  TemporaryFolder folder;
  std::atomic<int> wakes{0};
  Worker worker;
  explicit Running(int frames = 0) : worker{[this] { ++wakes; }, {1000, frames}} {
    fixtures::write_small_transport(folder / "t.hlt");
    fixtures::write_sky(folder / "a.exr", 1);
    worker.act(OpenTransport{folder / "t.hlt"});
    worker.act(OpenEnvironment{folder / "a.exr"});
  }
};

TEST(Worker, ShowsTheSettingsItWasGivenLastAndRests) {
  Running r;
  ViewSettings settings;
  for (int i = 1; i <= 200; ++i) {
    settings.yaw = 0.01 * i;
    settings.method = i % 2 ? LightingMethod::nwa : LightingMethod::pbi;
    r.worker.set(settings);
  }
  // Its last frame is there before it says that it rests.
  ASSERT_TRUE(wait_for([&] {
    const bool idle = r.worker.idle();
    r.worker.update();
    return idle;
  }));
  const ViewFrame& frame = r.worker.frame();
  EXPECT_TRUE(frame.converged);
  EXPECT_EQ(frame.light.rotation, rotation_y(2.0) * rotation_x(0));
  EXPECT_GT(r.wakes.load(), 0);

  // At rest it makes no frames.
  const std::uint64_t number = frame.number;
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(r.worker.update());
  EXPECT_EQ(r.worker.frame().number, number);
}

TEST(Worker, TellsWhatFailedAndGoesOn) {
  Running r;
  ASSERT_TRUE(wait_for([&] { return r.worker.update() && r.worker.frame().number > 0; }));
  r.worker.take_notices();
  haarlight::write_bytes(r.folder / "bad.hlt", "nothing of ours");
  r.worker.act(OpenTransport{r.folder / "bad.hlt"});
  r.worker.act(SavePicture{r.folder / "p.exr"});
  ASSERT_TRUE(wait_for([&] { return r.worker.idle(); }));
  const std::vector<Notice> notices = r.worker.take_notices();
  ASSERT_EQ(notices.size(), 2u);
  EXPECT_TRUE(notices[0].failed);
  EXPECT_NE(notices[0].text.find("bad.hlt"), std::string::npos);
  EXPECT_EQ(notices[0].text.find('\n'), std::string::npos);
  EXPECT_FALSE(notices[1].failed);
  EXPECT_TRUE(std::filesystem::exists(r.folder / "p.exr"));
  ViewSettings settings;
  settings.yaw = 1;
  r.worker.set(settings);
  EXPECT_TRUE(wait_for([&] { return r.worker.update(); }));
}

// A display slower than relighting sees every frame; one that is hidden does not hold them up.
TEST(Worker, WaitsForTheDisplayButNotForEver) {
  using Clock = std::chrono::steady_clock;
  Running r;
  ViewSettings settings;
  settings.playing = true;
  settings.method = LightingMethod::nwa;
  r.worker.set(settings);
  ASSERT_TRUE(wait_for([&] { return r.worker.update(); }));
  int looked_at = 0;
  Clock::time_point taken = Clock::now(), asked = taken;
  for (int i = 0; i < 100 && (i < 20 || looked_at == 0); ++i) {
    const std::uint64_t before = r.worker.frame().number;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_TRUE(wait_for([&] {
      asked = Clock::now();
      return r.worker.update();
    }));
    // Where this thread was held up itself, the worker was right to go on.
    if (Clock::now() - taken < std::chrono::milliseconds(200)) {
      EXPECT_EQ(r.worker.frame().number, before + 1);
      ++looked_at;
    }
    taken = asked;
  }
  EXPECT_GT(looked_at, 0);
  // One look at a hidden display in 0.9 s finds later frames; on a busy machine the third, say.
  bool went_on = false;
  for (int look = 0; look < 10 && !went_on; ++look) {
    const std::uint64_t before = r.worker.frame().number;
    std::this_thread::sleep_for(std::chrono::milliseconds(900));
    ASSERT_TRUE(wait_for([&] { return r.worker.update(); }));
    went_on = r.worker.frame().number > before + 1;
  }
  EXPECT_TRUE(went_on);
}

// Frames that are counted are all handed over, at rest too, and their motion is in frames.
TEST(Worker, MakesAsManyFramesAsItIsAskedFor) {
  constexpr int kFrames = 40;
  Running r(kFrames);
  ViewSettings settings;
  settings.playing = true;
  settings.loop = false;
  settings.speed = 10;
  r.worker.set(settings);
  for (std::uint64_t i = 1; i <= kFrames; ++i) {
    ASSERT_TRUE(wait_for([&] { return r.worker.update(); })) << i;
    ASSERT_EQ(r.worker.frame().number, i);
    if (i == 2) std::this_thread::sleep_for(std::chrono::milliseconds(600));
  }
  EXPECT_TRUE(wait_for([&] { return r.worker.idle(); }));
  EXPECT_FALSE(r.worker.update());
  EXPECT_FALSE(r.worker.busy());
}

// Settings that no frame can be made with are told once, not sixty times a second.
TEST(Worker, WaitsForSomethingElseAfterAFrameThatFailed) {
  Running r;
  ASSERT_TRUE(wait_for([&] { return r.worker.update() && r.worker.frame().number > 0; }));
  ASSERT_TRUE(wait_for([&] {
    r.worker.update();
    return r.worker.idle();
  }));
  r.worker.take_notices();
  ViewSettings settings;
  settings.wavelets = 0;
  r.worker.set(settings);
  ASSERT_TRUE(wait_for([&] { return r.worker.idle(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const std::vector<Notice> notices = r.worker.take_notices();
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_TRUE(notices[0].failed);
}

}  // namespace
}  // namespace haarlight::viewer
