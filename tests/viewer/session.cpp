// The session: what it shows is T times what it says it shows, whatever is asked of it.

#include "viewer/session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <optional>
#include <vector>

#include "core/error.h"
#include "prt/image_relighter.h"
#include "prt/motion_background.h"
#include "prt/relight_sequence.h"
#include "tests/viewer/inputs.h"

namespace {
std::atomic<long> g_allocations{0};
}

#ifndef __has_feature
#define __has_feature(name) 0
#endif

#if !__has_feature(thread_sanitizer)  // which has an allocator of its own, that none may replace
// Counts what the program takes from the heap, from any thread.
__attribute__((noinline)) void* operator new(std::size_t size) {
  g_allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
__attribute__((noinline)) void operator delete(void* memory) noexcept { std::free(memory); }
__attribute__((noinline)) void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}
#endif

namespace haarlight::viewer {
namespace {

using fixtures::TemporaryFolder;
using fixtures::write_sky;
using fixtures::write_small_transport;

/// A session with one environment, or two.
struct Opened {
  TemporaryFolder folder;
  Session session;
  ViewSettings settings;
  ViewFrame frame;

  explicit Opened(int environments = 1) {
    write_small_transport(folder / "t.hlt");
    session.act(OpenTransport{folder / "t.hlt"});
    for (int i = 0; i < environments; ++i) {
      const auto file = folder / ("sky" + std::to_string(i) + ".exr");
      write_sky(file, static_cast<std::uint64_t>(i) + 1);
      session.act(OpenEnvironment{file});
    }
    settings.playing = true;
    settings.wavelets = 12;
  }
  bool advance(double ticks = 1) { return session.advance(settings, ticks, frame); }
};

/// Largest difference of the picture from T * shown. Sums of n = 384 terms in double, rounded to
/// float once: 2^-23 of the largest partial sum, which is at most about ten times the picture.
void expect_picture_is_shown(const Session& session) {
  const FrameRelighter& relighter = *session.relighter();
  const Image expected = relight_once(relighter.transport(), relighter.tracker().shown());
  float largest = 1;
  for (const Rgb& c : expected.pixels) largest = std::max(largest, l1_norm(c));
  for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
    ASSERT_LE(l1_norm(relighter.picture().pixels[i] - expected.pixels[i]), 1e-6f * largest) << i;
  }
}

TEST(Session, PictureIsTransportTimesShownWhateverIsAsked) {
  Opened o(2);
  std::mt19937_64 random(3);
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  for (int i = 0; i < 150; ++i) {
    ViewSettings& s = o.settings;
    switch (pick(10)) {
      case 0:
        s.method = static_cast<LightingMethod>(pick(4));
        break;
      case 1:
        s.weight = static_cast<WaveletWeight>(pick(3));
        break;
      case 2:
        s.wavelets = 1 + pick(60);
        s.budget = static_cast<BudgetKind>(pick(3));
        break;
      case 3:
        s.yaw = 0.1 * pick(60);
        s.pitch = 0.1 * pick(10);
        break;
      case 4:
        o.session.act(SetBlend{0.1 * pick(11)});
        break;
      case 5:
        s.disc_count = pick(3);
        s.discs[0] = {normalize({1, 0.1 * pick(20), 0.3}), 0.1 + 0.1 * pick(5), {5, 4, 3}};
        break;
      case 6:
        o.session.act(Restart{static_cast<FrameStart>(pick(3))});
        break;
      case 7:
        s.motion = static_cast<MotionKind>(pick(6));
        o.session.act(Rewind{});
        break;
      case 8:
        s.compare = !s.compare;
        s.show_lighting = !s.show_lighting;
        break;
      case 9:
        s.background = 0.5 * pick(4);
        break;
    }
    if (o.advance(0.3 * pick(5))) expect_picture_is_shown(o.session);
  }
  EXPECT_GT(o.frame.number, 100u);
}

// The session plays the motions of the comparison: the same light, the same numbers.
TEST(Session, PlaysAMotionWithTheNumbersOfASequence) {
  Opened o;
  o.settings.motion = MotionKind::tumble;
  o.settings.degrees = 50;
  o.settings.loop = false;
  o.settings.compare = true;
  SequenceOptions options;
  options.motion = {.kind = MotionKind::tumble, .degrees = 50, .stop = 99};
  options.frames = 40;
  options.lighting.wavelets = 12;
  options.against_reference = true;
  relight_sequence(Transport::open(o.folder / "t.hlt"), load_environment(o.folder / "sky0.exr"),
                   nullptr, options, [&](const SequenceFrame& expected) {
                     EXPECT_TRUE(o.advance());
                     EXPECT_EQ(o.frame.picture.pixels, expected.picture.pixels);
                     EXPECT_EQ(o.frame.metrics.lighting_error, expected.metrics.lighting_error);
                     EXPECT_EQ(o.frame.metrics.image_rel_rmse, expected.metrics.image_rel_rmse);
                     EXPECT_EQ(o.frame.metrics.resets, expected.metrics.resets);
                     return true;
                   });
}

TEST(Session, ARecordingReplaysAsTheSameBits) {
  Opened o(2);
  o.settings.motion = MotionKind::swing;
  for (int i = 0; i < 5; ++i) o.advance();
  o.session.act(StartRecording{});
  std::vector<Image> pictures;
  std::vector<double> errors;
  for (int i = 0; i < 60; ++i) {
    if (i == 10) o.settings.method = LightingMethod::nwa;
    if (i == 20) o.settings.budget = BudgetKind::milliseconds;
    if (i == 25) o.settings.milliseconds = 0.05;
    if (i == 30) o.session.act(SetBlend{0.4});
    if (i == 35) o.settings.discs[0] = {normalize({1, 1, 1}), 0.3, {9, 8, 7}};
    if (i == 35) o.settings.disc_count = 1;
    if (i == 40) o.session.act(Restart{FrameStart::dark});
    if (i == 45) {
      write_sky(o.folder / "sky3.exr", 77);
      o.session.act(OpenEnvironment{o.folder / "sky3.exr", 5});
    }
    if (i == 50) o.settings.method = LightingMethod::bi;
    ASSERT_TRUE(o.advance());
    pictures.push_back(o.frame.picture);
    errors.push_back(o.frame.metrics.lighting_error);
  }
  o.session.act(StopRecording{o.folder / "m.json"});

  const MotionRecording recording = load_motion_file(o.folder / "m.json");
  ASSERT_EQ(recording.frames.size(), pictures.size());
  ASSERT_EQ(recording.environments.size(), 3u);
  std::vector<Environment> environments;
  for (const auto& file : recording.environments) environments.push_back(load_environment(file));
  std::size_t i = 0;
  relight_recording(Transport::open(o.folder / "t.hlt"), environments, recording, false,
                    [&](const SequenceFrame& frame) {
                      EXPECT_EQ(frame.picture.pixels, pictures[i].pixels) << "frame " << i;
                      EXPECT_EQ(frame.metrics.lighting_error, errors[i]) << "frame " << i;
                      ++i;
                      return true;
                    });
  EXPECT_EQ(i, pictures.size());
}

// A still light is reached in at most coefficients / wavelets frames, and then nothing is done.
TEST(Session, RestsWhenTheLightDoes) {
  Opened o;
  o.settings.playing = false;
  ASSERT_TRUE(o.advance());
  EXPECT_TRUE(o.frame.converged);  // it starts exact
  o.settings.yaw = 1;
  int frames = 0;
  while (!o.session.resting(o.settings)) {
    o.advance();
    ASSERT_LE(++frames, 6 * 8 * 8 / 12 + 1);
  }
  EXPECT_GT(frames, 1);
  EXPECT_TRUE(o.frame.converged);
  const std::uint64_t number = o.frame.number;
  EXPECT_FALSE(o.advance());
  EXPECT_EQ(o.frame.number, number);
  o.session.act(Step{});
  EXPECT_TRUE(o.advance());  // one frame, then rest again
}

TEST(Session, FadesToAnEnvironmentThatIsOpened) {
  Opened o;
  o.settings.playing = false;
  o.settings.method = LightingMethod::reference;
  o.advance();
  write_sky(o.folder / "next.exr", 9);
  o.session.act(OpenEnvironment{o.folder / "next.exr", 10});
  double before = -1;
  for (int i = 0; i <= 10; ++i) {
    ASSERT_TRUE(o.advance());
    EXPECT_GT(o.frame.light.blend, before);
    before = o.frame.light.blend;
  }
  // Ten steps of a tenth, each rounded.
  EXPECT_NEAR(before, 1, 1e-15);
  Session only;
  ViewFrame alone;
  only.act(OpenTransport{o.folder / "t.hlt"});
  only.act(OpenEnvironment{o.folder / "next.exr"});
  only.advance(o.settings, 1, alone);
  o.session.act(SetBlend{1});
  o.session.act(Restart{FrameStart::exact});
  o.advance();
  EXPECT_EQ(o.frame.picture.pixels, alone.picture.pixels);
}

TEST(Session, AFileThatDoesNotOpenChangesNothing) {
  Opened o;
  o.advance();
  const Image picture = o.frame.picture;
  const auto refused = [&](const ViewAction& action) {
    EXPECT_THROW(o.session.act(action), Error);
  };
  haarlight::write_bytes(o.folder / "bad.hlt", "no transport at all");
  haarlight::write_bytes(o.folder / "bad.exr", "no picture");
  Image nan(64, 32);
  for (Rgb& c : nan.pixels) c = {NAN, NAN, NAN};
  save_image(o.folder / "nan.exr", nan);
  refused(OpenTransport{o.folder / "bad.hlt"});
  refused(OpenTransport{o.folder / "none.hlt"});
  refused(OpenEnvironment{o.folder / "bad.exr"});
  refused(OpenEnvironment{o.folder / "nan.exr"});
  refused(StopRecording{o.folder / "m.json"});
  refused(SetBlend{2});
  refused(SavePicture{o.folder / "no" / "folder.exr"});
  EXPECT_TRUE(o.session.ready());
  o.session.act(Restart{FrameStart::exact});
  o.session.act(Rewind{});
  ASSERT_TRUE(o.advance(0));
  EXPECT_EQ(o.frame.picture.pixels, picture.pixels);
  ViewSettings wrong = o.settings;
  wrong.wavelets = 0;
  EXPECT_THROW(o.session.advance(wrong, 1, o.frame), Error);
  wrong = o.settings;
  wrong.yaw = NAN;
  EXPECT_THROW(o.session.advance(wrong, 1, o.frame), Error);
  o.session.act(Step{});
  EXPECT_TRUE(o.advance());
}

TEST(Session, DoesNothingUntilThereIsSomethingToShow) {
  Session session;
  ViewFrame frame;
  EXPECT_FALSE(session.advance({}, 1, frame));
  EXPECT_TRUE(session.resting({}));
  EXPECT_THROW(session.act(SavePicture{"a.exr"}), Error);
  EXPECT_THROW(session.act(StartRecording{}), Error);
}

TEST(Session, FramesTouchNoHeapOnceWarm) {
#if __has_feature(thread_sanitizer)
  GTEST_SKIP() << "the sanitizer allocates for itself";
#endif
  Opened o(2);
  o.settings.compare = true;
  o.settings.show_lighting = true;
  o.settings.motion = MotionKind::light;
  o.session.act(SetBlend{0.5});
  for (int i = 0; i < 99; ++i) o.advance();
  const long before = g_allocations.load();
  for (int i = 0; i < 60; ++i) ASSERT_TRUE(o.advance());
  EXPECT_EQ(g_allocations.load() - before, 0);
}

TEST(OrbitCamera, KeepsItsMiddleAndItsDistance) {
  const BoundingSphere middle{{1, 2, 3}, 1};
  const Camera file = look_at({4, 4, 8}, middle.center, 0.7, 64, 48);
  EXPECT_EQ(orbit_camera(file, middle, {}), file);
  const double distance = length(file.position - middle.center);
  ViewSettings s;
  for (const double orbit : {0.0, 1.0, -2.5}) {
    for (const double elevation : {0.0, 0.5, -1.2, 3.0}) {
      s.orbit = orbit;
      s.elevation = elevation;
      s.closer = 1;
      const Camera camera = orbit_camera(file, middle, s);
      EXPECT_NEAR(length(camera.position - middle.center), 0.5 * distance, 1e-12);
      // The middle stays in the middle of the picture, and the horizon level.
      const Vec3 seen = camera.direction(32, 24);
      EXPECT_NEAR(dot(seen, normalize(middle.center - camera.position)), 1, 1e-12);
      EXPECT_NEAR((camera.orientation * Vec3{1, 0, 0}).y, 0, 1e-12);
      EXPECT_GT((camera.orientation * Vec3{0, 1, 0}).y, 0);
    }
  }
}

}  // namespace
}  // namespace haarlight::viewer
