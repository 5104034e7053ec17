// Recorded motions: back from text as the same bits, replayed as the same numbers, refused with
// the frame and the key.

#include "prt/motion_file.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "core/error.h"
#include "core/image_metrics.h"
#include "prt/relight_sequence.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using fixtures::TemporaryFolder;

Environment sky(float seed) {
  Image image(64, 32);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      image.at(x, y) = {seed + static_cast<float>(x), 1 + static_cast<float>(y) * seed,
                        static_cast<float>((x * 7 + y * 13) % 11)};
    }
  }
  return Environment(image);
}

/// Frames that change everything there is, by numbers without short decimals.
MotionRecording eventful() {
  MotionRecording recording;
  recording.environments = {"a.exr", "b.exr"};
  for (int i = 0; i < 12; ++i) {
    RecordedFrame frame;
    frame.start = i == 0 ? FrameStart::exact : i == 7 ? FrameStart::dark : FrameStart::advance;
    frame.light.rotation = rotation_x(0.1 * i / 3) * rotation_y(i / 7.0);
    frame.light.from = i > 5;
    frame.light.to = i <= 5;
    frame.light.blend = i % 4 / 3.0;
    frame.light.background = 1 + i / 9.0;
    if (i > 3) {
      frame.light.discs = {
          {normalize({1.0 * i, 2, 3}), 0.1 + i / 30.0, {0.1f * static_cast<float>(i), 2, 3}}};
    }
    if (i == 9) frame.light.discs.clear();
    frame.method = static_cast<LightingMethod>(i / 3);
    frame.wavelets = 5 + i;
    frame.weight = static_cast<WaveletWeight>(i % 3);
    if (i % 4 == 1) frame.course = {true, i == 5 ? 3 : 0, i > 5 ? 0b1010u : 0u};
    recording.frames.push_back(frame);
  }
  return recording;
}

TEST(MotionFile, ComesBackAsTheSameBits) {
  const TemporaryFolder folder;
  const MotionRecording recording = eventful();
  save_motion_file(folder.path() / "m.json", recording);
  const MotionRecording back = load_motion_file(folder.path() / "m.json");
  EXPECT_EQ(back.frames, recording.frames);
  ASSERT_EQ(back.environments.size(), 2u);
  EXPECT_EQ(back.environments[1], folder.path() / "b.exr");  // taken from the file's folder
}

TEST(MotionFile, FramesSayOnlyWhatTheyChange) {
  const MotionRecording m = parse_motion(
      R"({"format": "haarlight-motion", "version": 1, "environments": ["a.exr"],
          "frames": [{"start": "exact", "wavelets": 7, "timed": {"first": 2}}, {}, {"method": "nwa"},
                     {"wavelets": 9, "timed": {}}]})",
      "m");
  ASSERT_EQ(m.frames.size(), 4u);
  EXPECT_EQ(m.frames[0].start, FrameStart::exact);
  EXPECT_EQ(m.frames[0].course.first, 2);
  EXPECT_EQ(m.frames[1].start, FrameStart::advance);
  EXPECT_EQ(m.frames[1].course, FrameCourse{});
  EXPECT_TRUE(m.frames[3].course.timed);
  EXPECT_EQ(m.frames[1].wavelets, 7);
  EXPECT_EQ(m.frames[3].method, LightingMethod::nwa);
  EXPECT_EQ(m.frames[3].wavelets, 9);
}

// What a motion of the comparison does, written down frame by frame, gives its numbers: the way by
// file changes no bit.
TEST(MotionFile, ReplayGivesTheNumbersOfTheMotion) {
  const fixtures::SmallTransport small = fixtures::small_transport(8, 16, 16, 5);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const Environment environments[] = {sky(0.5f)};
  SequenceOptions options;
  options.motion = {.kind = MotionKind::tumble, .degrees = 70, .stop = 9};
  options.frames = 14;
  options.lighting.wavelets = 20;
  options.against_reference = true;
  MotionRecording recording;
  recording.environments = {"a.exr"};
  std::vector<std::pair<FrameMetrics, Image>> expected;
  relight_sequence(transport, environments[0], nullptr, options, [&](const SequenceFrame& frame) {
    expected.emplace_back(frame.metrics, frame.picture);
    RecordedFrame recorded;
    recorded.light.rotation = motion_rotation(options.motion, frame.metrics.frame);
    recorded.wavelets = frame.metrics.wavelets;
    recorded.start = frame.metrics.frame == 0 ? FrameStart::exact : FrameStart::advance;
    recording.frames.push_back(recorded);
    return true;
  });
  for (const bool judge : {false, true}) {
    const auto estimated = [&](const SequenceFrame& frame) {
      EXPECT_EQ(frame.metrics.error_estimate.has_value(), judge);
      EXPECT_EQ(frame.metrics.error_bound.has_value(), judge);
      return true;
    };
    relight_recording(transport, environments, recording, false, estimated, {}, judge);
  }
  std::size_t frames = 0;
  relight_recording(transport, environments, parse_motion(motion_text(recording), "m"), true,
                    [&](const SequenceFrame& frame) {
                      const auto& [metrics, picture] = expected.at(frames++);
                      EXPECT_EQ(frame.picture.pixels, picture.pixels);
                      EXPECT_EQ(frame.metrics.lighting_error, metrics.lighting_error);
                      EXPECT_EQ(frame.metrics.image_rel_rmse, metrics.image_rel_rmse);
                      EXPECT_EQ(frame.metrics.resets, metrics.resets);
                      EXPECT_EQ(frame.metrics.updates, metrics.updates);
                      return true;
                    });
  EXPECT_EQ(frames, expected.size());
}

// What the clock decided is in the recording: parts, and bands that were put off. Pictures are
// those of the shown lighting all the same, of a mesh, too, and when nothing is left for the second
// part.
TEST(MotionFile, FramesUnderATimeAreReplayedAsTheyWent) {
  const fixtures::SmallTransport image = fixtures::small_transport(8, 16, 16, 5);
  const fixtures::SmallTransport mesh =
      fixtures::small_mesh_transport(8, fixtures::bumpy_sphere(150, 6), 7);
  const Environment environments[] = {sky(0.5f)};
  constexpr int kWavelets = 12;
  for (const fixtures::SmallTransport* small : {&image, &mesh}) {
    const Transport transport = build_transport(small->info, small->tiles, small->thresholds);
    MotionRecording recording;
    recording.environments = {"a.exr"};
    for (int i = 0; i < 40; ++i) {
      RecordedFrame frame;
      frame.light.rotation = rotation_y(0.3 * i);
      frame.wavelets = kWavelets;
      if (i == 0) frame.start = FrameStart::exact;
      frame.course = {true, i % (kWavelets + 1), i % 3 == 1 ? ~0u : i % 3 == 2 ? 0b100u : 0u};
      recording.frames.push_back(frame);
    }
    LightRig rig(transport.layout());
    rig.set_environment(0, environments[0]);
    LightingOptions options;
    options.wavelets = kWavelets;
    FrameRelighter direct(transport, options, WaveletWeight::area);
    int resets = 0, put_off = 0, number = 0;
    relight_recording(
        transport, environments, parse_motion(motion_text(recording), "m"), false,
        [&](const SequenceFrame& frame) {
          const RecordedFrame& recorded = recording.frames[static_cast<std::size_t>(number)];
          const auto target = rig.coefficients(recorded.light);
          direct.repeat(recorded.course);
          const FrameMetrics& metrics = direct.relight(target, recorded.start, number);
          EXPECT_EQ(frame.picture.pixels, direct.picture().pixels) << number;
          EXPECT_EQ(frame.metrics.lighting_error, metrics.lighting_error) << number;
          EXPECT_EQ(frame.metrics.course, recorded.course) << number;
          EXPECT_EQ(frame.metrics.resets, metrics.resets) << number;
          if (number > 0) {
            EXPECT_LE(metrics.updates, kWavelets);
            EXPECT_TRUE((direct.update().reset & recorded.course.put_off).none()) << number;
            resets += direct.update().reset.any();
            put_off += recorded.course.put_off.all();
          }
          // Sums in double, pixels in float: a rounding each, and those of a mesh's weights.
          const Image right =
              relight_picture_once(transport, direct.tracker().shown(), direct.view().camera);
          EXPECT_LT(compare_images(frame.picture, right).relative_rmse, 1e-6) << number;
          ++number;
          return true;
        });
    EXPECT_EQ(number, 40);
    EXPECT_GT(resets, 3);
    EXPECT_GT(put_off, 10);
  }
}

// From a dark start the budget is all there is: an update holds at most that many wavelets and
// nothing else is shown.
TEST(MotionFile, ADarkStartForgetsWhatWasShown) {
  const fixtures::SmallTransport small = fixtures::small_transport(8, 16, 16, 5);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const Environment environment = sky(1);
  LightRig rig(transport.layout());
  rig.set_environment(0, environment);
  const auto target = rig.coefficients({});
  LightingOptions lighting;
  lighting.wavelets = 10;
  FrameRelighter twice(transport, lighting, WaveletWeight::area);
  twice.relight(target, FrameStart::exact, 0);
  twice.relight(target, FrameStart::dark, 1);
  FrameRelighter once(transport, lighting, WaveletWeight::area);
  once.relight(target, FrameStart::advance, 0);
  EXPECT_EQ(twice.picture().pixels, once.picture().pixels);
  EXPECT_TRUE(std::equal(twice.tracker().shown().begin(), twice.tracker().shown().end(),
                         once.tracker().shown().begin()));
}

TEST(MotionFile, NamesFrameAndKeyOfWhatIsWrong) {
  const auto message = [](const std::string& frames) -> std::string {
    try {
      parse_motion(R"({"format": "haarlight-motion", "version": 1, "environments": ["a.exr"],)"
                   R"("frames": )" +
                       frames + "}",
                   "m.json");
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::format);
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    ADD_FAILURE() << frames;
    return {};
  };
  EXPECT_EQ(message(R"([{}, {"wavelet": 3}])"), "m.json, frame 1, wavelet: is no key of a frame");
  EXPECT_EQ(message(R"([{"method": "fast"}])"),
            "m.json, frame 0, method: is \"fast\", expected nwa, bi, pbi or reference");
  EXPECT_EQ(message(R"([{"blend": 2}])"), "m.json, frame 0: blend is 2, expected 0 to 1");
  EXPECT_EQ(message(R"([{"from": 1}])"),
            "m.json, frame 0: from is environment 1, expected one of 1");
  EXPECT_EQ(message(R"([{"rotation": [1, 2]}])"),
            "m.json, frame 0, rotation: has 2 entries, expected 9");
  EXPECT_NE(message(R"([{"rotation": [1,0,0, 0,1,0, 0,0,2]}])").find("orthonormal"),
            std::string::npos);
  for (const char* text :
       {"[]", "{}", "[3]", R"([{"lights": 3}])", R"([{"wavelets": 0}])",
        R"([{"lights": [{"direction": [0, 0, 0]}]}])", R"([{"wavelets": 1e300}])",
        R"([{"start": "again"}])", R"([{"timed": true}])", R"([{"timed": {"put_off": [99]}}])",
        R"([{"timed": {"put_off": 1}}])", R"([{"timed": {"last": 1}}])"}) {
    message(text);
  }
  EXPECT_THROW(parse_motion("", "m"), Error);
  EXPECT_THROW(parse_motion("[]", "m"), Error);
  EXPECT_THROW(parse_motion(R"({"format": "haarlight-motion", "version": 2})", "m"), Error);
  EXPECT_THROW(load_motion_file("/nonexistent/m.json"), Error);
  EXPECT_THROW(save_motion_file("/nonexistent/m.json", {}), Error);
}

}  // namespace
}  // namespace haarlight
