// The window itself, under a virtual display and software OpenGL: what a person does, by script.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "core/image_io.h"
#include "data_gen/animations.h"
#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"
#include "tests/viewer/inputs.h"

namespace haarlight::fixtures {
namespace {

/// Mean over the boxes of a grid, so that pictures of different size can be compared.
std::vector<double> boxes(const Image& image, int columns, int rows) {
  std::vector<double> out;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int x0 = i * image.width / columns, x1 = (i + 1) * image.width / columns;
      const int y0 = j * image.height / rows, y1 = (j + 1) * image.height / rows;
      for (int channel = 0; channel < 3; ++channel) {
        double sum = 0;
        for (int y = y0; y < y1; ++y) {
          for (int x = x0; x < x1; ++x) {
            const Rgb& c = image.at(x, y);
            sum += static_cast<double>(channel == 0 ? c.r : channel == 1 ? c.g : c.b);
          }
        }
        out.push_back(sum / ((x1 - x0) * (y1 - y0)));
      }
    }
  }
  return out;
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double ma = mean(a), mb = mean(b);
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

/// xvfb-run looks for a free display by trying, and now and then two that begin together take the
/// same one: it then ends with 5 before the program began.
ProgramResult run_with_display(const std::vector<std::string>& words,
                               const std::filesystem::path& folder) {
  constexpr int kNoDisplay = 5;
  ProgramResult result;
  for (int attempt = 0; attempt < 5; ++attempt) {
    result = run_program(words, folder);
    if (result.code != kNoDisplay) break;
  }
  return result;
}

class ViewWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    write_table_scene(folder_ / "table.obj");
    const std::string command = "cd '" + folder_.path().string() +
                                "' && " HAARLIGHT_RELIGHT
                                " precompute table.obj -o t.hlt --size 64x48 --face 8 "
                                ">/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0);
    save_image(folder_ / "room.exr", room_environment());
    save_image(folder_ / "grey.exr", constant_environment({0.6f, 0.5f, 0.4f}));
  }
  ProgramResult show(const std::string& script, std::vector<std::string> more = {}) {
    write_bytes(folder_ / "script.txt", script);
    std::vector<std::string> words{"-a",           "-s",       "-screen 0 1600x1200x24",
                                   HAARLIGHT_VIEW, "--script", "script.txt",
                                   "--no-memory"};
    words.insert(words.end(), more.begin(), more.end());
    return run_with_display(words, folder_.path());
  }
  /// The session's own picture of what the window showed.
  Image headless(std::vector<std::string> more) {
    std::string command = "cd '" + folder_.path().string() +
                          "' && " HAARLIGHT_VIEW
                          " t.hlt --headless --frames 1 --screenshot headless.png";
    for (const std::string& word : more) command += " " + word;
    EXPECT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0);
    return load_image(folder_ / "headless.png");
  }
  /// 16 x 12 boxes of 4 x 4 pixels of the transport: the screen's smoothing between pixels moves
  /// light by less than a pixel, a sixteenth of a box or so.
  void expect_alike(const std::string& shot, const Image& expected) {
    const auto a = boxes(load_image(folder_ / shot), 16, 12), b = boxes(expected, 16, 12);
    EXPECT_GT(correlation(a, b), 0.97) << shot;
    EXPECT_NEAR(mean(a), mean(b), 0.03 * mean(b)) << shot;
  }
  TemporaryFolder folder_;
};

TEST_F(ViewWindow, ShowsThePictureOfTheSession) {
  const ProgramResult result =
      show("settle\nshot_picture a.png\nkey t\nkey t\nwait 3\nshot_picture linear.png\nclose\n",
           {"t.hlt", "--env", "room.exr", "--exposure", "0", "--motion", "still"});
  ASSERT_EQ(result.code, 0) << result.err;
  expect_alike("a.png", headless({"--env", "room.exr", "--exposure", "0"}));
  const Image linear = headless({"--env", "room.exr", "--exposure", "0", "--tonemap", "reinhard"});
  expect_alike("linear.png", linear);
}

TEST_F(ViewWindow, DoesWhatKeysAndPointerSay) {
  const ProgramResult result = show(
      "settle\nshot_picture before.png\n"
      "drag 0.3 0.5 0.8 0.5 picture\nsettle\nshot_picture turned.png\n"
      "key 1\nwait 5\nkey space\nwait 20\nexpect_method nwa\nkey space\n"
      "key 4\nsettle\nexpect_method reference\n"
      "click PBI\nclick time\nclick error\nclick wavelets\nclick add lamp\nsettle\n"
      "shot_picture lamp.png\n"
      "drag 0.5 0.5 0.9 0.5 budget\ndrag 0.2 0.2 0.4 0.3 map\nclick cube\nclick play\nwait 10\n"
      "click play\nkey c\nwait 5\ndrag 0.5 0.5 0.2 0.5 picture\nkey c\nkey f\nwait 5\n"
      "shot all.png\nkey h\nwait 3\nkey escape\nkey tab\nwait 3\nkey tab\n"
      "resize 1 1\nresize 400 300\nresize 1100 700\nsettle\nshot end.png\ncontrol q\nwait 5\n",
      {"t.hlt", "--env", "room.exr", "--exposure", "0", "--motion", "rotate"});
  ASSERT_EQ(result.code, 0) << result.err;
  // The light came from elsewhere, and then there was more of it.
  const auto before = boxes(load_image(folder_ / "before.png"), 16, 12);
  const auto turned = boxes(load_image(folder_ / "turned.png"), 16, 12);
  EXPECT_LT(correlation(before, turned), 0.99);
  EXPECT_GT(mean(boxes(load_image(folder_ / "lamp.png"), 16, 12)), mean(turned));
  EXPECT_EQ(load_image(folder_ / "end.png").width, 1100);
}

TEST_F(ViewWindow, TakesFilesThatAreDroppedAndSurvivesBadOnes) {
  write_bytes(folder_ / "bad.hlt", "no transport");
  write_bytes(folder_ / "bad.exr", "no picture");
  const ProgramResult result = show(
      "wait 5\nshot empty.png\n"
      "drop none.hlt\nsettle\nexpect_message none.hlt\n"
      "drop t.hlt\nsettle\ndrop room.exr\nsettle\nexpect_message room.exr\n"
      "drop bad.hlt\nsettle\nexpect_message bad.hlt\n"
      "drop bad.exr\nsettle\nexpect_message bad.exr\n"
      "drop notes.txt\nwait 3\nexpect_message neither\n"
      "drop grey.exr\nsettle\nwait 3\nshot_picture grey.png\n"
      "key x\nsettle\nexpect_message haarlight-1.exr\n"
      "key p\nwait 3\nexpect_message haarlight-1.png\n"
      "key m\nsettle\nkey space\nwait 20\nkey m\nwait 10\nexpect_message motion-1.json\nkey "
      "space\nsettle\n"
      "key o\nwait 3\ntype room.exr\nkey enter\nsettle\nexpect_message room.exr\nclose\n",
      {"--exposure", "0"});
  ASSERT_EQ(result.code, 0) << result.err;
  // Faded to the last one that opened: the light of grey.exr alone.
  expect_alike("grey.png", headless({"--env", "grey.exr", "--exposure", "0"}));
  EXPECT_EQ(load_image(folder_ / "haarlight-1.exr").width, 64);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "motion-1.json"));
}

// The generous bound is for machines that do other things; a few per cent of a core is normal.
TEST_F(ViewWindow, RestsWhenNothingMoves) {
  const ProgramResult result =
      show("settle\nwait 5\nrest 3\nclose\n", {"t.hlt", "--env", "room.exr", "--motion", "still"});
  ASSERT_EQ(result.code, 0) << result.err;
  const std::string name = "rest_cpu_percent ";
  const std::size_t at = result.out.find(name);
  ASSERT_NE(at, std::string::npos) << result.out;
  EXPECT_LT(std::atof(result.out.c_str() + at + name.size()), 15);
}

TEST_F(ViewWindow, RemembersTheWindowAndTheFiles) {
  ::setenv("XDG_CONFIG_HOME", (folder_ / "config").c_str(), 1);
  const auto run = [&](const std::string& script, std::vector<std::string> more) {
    write_bytes(folder_ / "script.txt", script);
    std::vector<std::string> words{"-a",           "-s",       "-screen 0 1600x1200x24",
                                   HAARLIGHT_VIEW, "--script", "script.txt"};
    words.insert(words.end(), more.begin(), more.end());
    return run_with_display(words, folder_.path());
  };
  ASSERT_EQ(
      run("settle\nresize 900 640\nkey l\nwait 3\nclose\n", {"t.hlt", "--env", "room.exr"}).code,
      0);
  const ProgramResult again = run("settle\nexpect_method pbi\nshot again.png\nclose\n", {});
  ::unsetenv("XDG_CONFIG_HOME");
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(load_image(folder_ / "again.png").width, 900);
  EXPECT_EQ(load_image(folder_ / "again.png").height, 640);
}

TEST_F(ViewWindow, GoesRoundAMesh) {
  const std::string command =
      "cd '" + folder_.path().string() +
      "' && " HAARLIGHT_RELIGHT
      " precompute table.obj -o mesh.hlt --vertices --face 8 >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const ProgramResult result = show(
      "settle\nshot_picture first.png\n"
      "drag_right 0.3 0.5 0.6 0.5 picture\nsettle\nshot_picture round.png\n"
      "drag_right 0.5 0.4 0.5 0.6 picture\nsettle\nshot_picture over.png\n"
      "wheel 4 picture\nsettle\nshot_picture closer.png\n"
      "drag_middle 0.5 0.5 0.7 0.5 picture\nsettle\nshot_picture moved.png\n"
      "key 0\nsettle\nshot_picture back.png\nclose\n",
      {"mesh.hlt", "--env", "room.exr", "--exposure", "0", "--motion", "still"});
  ASSERT_EQ(result.code, 0) << result.err;
  // Without the lowest row of boxes, where messages come and go.
  const auto seen = [&](const char* shot) {
    auto all = boxes(load_image(folder_ / shot), 16, 12);
    all.resize(all.size() - 3 * 16);
    return all;
  };
  const char* shots[] = {"first.png", "round.png", "over.png", "closer.png", "moved.png"};
  for (int i = 1; i < 5; ++i) {
    EXPECT_LT(correlation(seen(shots[i - 1]), seen(shots[i])), 0.99) << shots[i];
  }
  EXPECT_GT(correlation(seen("first.png"), seen("back.png")), 0.999);
}

TEST_F(ViewWindow, EveryControlIsInSightWithALampChosenAndTwoEnvironments) {
  for (const auto& [size, scale] : {std::pair{"1280x800", "1"}, std::pair{"1560x1200", "1.5"}}) {
    const ProgramResult result = show(
        "settle\nwait 5\nclick add lamp\nsettle\nwait 5\nexpect_inside lamp radiance\n"
        "expect_inside blend\nexpect_inside auto\nshot panel.png\nclose\n",
        {"t.hlt", "--env", "room.exr", "--env-to", "grey.exr", "--motion", "still", "--size", size,
         "--scale", scale});
    EXPECT_EQ(result.code, 0) << size << ": " << result.err;
  }
}

/// Of a metrics table: all but the times and what comes after them.
std::vector<std::string> numbers_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<std::string> rows;
  for (std::string line; std::getline(stream, line);) {
    std::size_t end = 0;
    for (int column = 0; column < 7; ++column) end = line.find(',', end) + 1;
    rows.push_back(line.substr(0, end));
  }
  return rows;
}

// More frames than the motion has, and a display slower than relighting.
TEST_F(ViewWindow, CountedFramesAreThoseWithoutAWindow) {
  const std::vector<std::string> what = {"t.hlt",  "--env",    "room.exr", "--motion",
                                         "rotate", "--speed",  "4",        "--wavelets",
                                         "40",     "--frames", "60"};
  std::vector<std::string> words{"-a",           "-s",          "-screen 0 1600x1200x24",
                                 HAARLIGHT_VIEW, "--no-memory", "--metrics",
                                 "window.csv",   "--record",    "window.json"};
  words.insert(words.end(), what.begin(), what.end());
  const ProgramResult result = run_with_display(words, folder_.path());
  ASSERT_EQ(result.code, 0) << result.err;
  std::string command = "cd '" + folder_.path().string() +
                        "' && " HAARLIGHT_VIEW " --headless --metrics headless.csv";
  for (const std::string& word : what) command += " " + word;
  ASSERT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0);
  const auto rows = numbers_of(folder_ / "window.csv");
  EXPECT_EQ(rows.size(), 61u);
  EXPECT_EQ(rows, numbers_of(folder_ / "headless.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "window.json"));
}

TEST_F(ViewWindow, CountedFramesThatCannotBeMadeEndTheProgram) {
  write_bytes(folder_ / "bad.hlt", "no transport");
  const ProgramResult result =
      run_with_display({"-a", "-s", "-screen 0 1600x1200x24", HAARLIGHT_VIEW, "--no-memory",
                        "bad.hlt", "--env", "room.exr", "--frames", "5"},
                       folder_.path());
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("bad.hlt"), std::string::npos) << result.err;
}

TEST_F(ViewWindow, SaysWhichLineOfAScriptFailed) {
  const ProgramResult result = show("wait 2\nclick nothing of that name\n");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("line 2"), std::string::npos) << result.err;
}

TEST_F(ViewWindow, PlaysASceneThatMoves) {
  data_gen::save_animation(folder_ / "box.glb", "cube-in-box");
  const ProgramResult result =
      run_with_display({"-a", "-s", "-screen 0 1600x1200x24", HAARLIGHT_VIEW, "box.glb", "--frames",
                        "12", "--pause-at", "2", "--picture", "96x72", "--size", "480x360", "--spp",
                        "4", "--exr", "box.exr", "--screenshot", "box.png"},
                       folder_.path());
  ASSERT_EQ(result.code, 0) << result.err;
  // The picture fills the window: the same shape. What the panel, top left, does not cover is what
  // the session has, but for its tonemapping: red on the left, green on the right, as bright below.
  const Image shot = load_image(folder_ / "box.png"), radiance = load_image(folder_ / "box.exr");
  ASSERT_EQ(shot.width, 480);
  ASSERT_EQ(radiance.width, 96);
  const auto patch = [](const Image& image, int column) {  // of 8 x 6 boxes, the row above the last
    const std::vector<double> all = boxes(image, 8, 6);
    const auto at = all.begin() + 3 * (4 * 8 + column);
    return std::vector<double>(at, at + 3);
  };
  for (const int column : {0, 7}) {
    const std::vector<double> shown = patch(shot, column), sent = patch(radiance, column);
    const std::size_t wall = column == 0 ? 0 : 1;
    EXPECT_GT(shown[wall], 1.5 * shown[1 - wall]) << column;
    EXPECT_GT(sent[wall], 1.5 * sent[1 - wall]) << column;
  }
}

TEST_F(ViewWindow, PlaysASceneThatMovesByVirtualLights) {
  data_gen::save_animation(folder_ / "box.glb", "cube-in-box");
  const std::vector<std::string> common = {"box.glb", "--frames", "6", "--picture", "96x72"};
  std::vector<std::string> with = {"-a", "-s", "-screen 0 1600x1200x24", HAARLIGHT_VIEW};
  with.insert(with.end(), common.begin(), common.end());
  for (const char* word :
       {"--renderer", "tic", "--size", "480x360", "--exr", "tic.exr", "--screenshot", "tic.png"}) {
    with.emplace_back(word);
  }
  const ProgramResult result = run_with_display(with, folder_.path());
  ASSERT_EQ(result.code, 0) << result.err;
  std::vector<std::string> without = {"-a", HAARLIGHT_VIEW};
  without.insert(without.end(), common.begin(), common.end());
  for (const char* word : {"--headless", "--renderer", "igi", "--exr", "igi.exr"}) {
    without.emplace_back(word);
  }
  const ProgramResult other = run_with_display(without, folder_.path());
  ASSERT_EQ(other.code, 0) << other.err;
  // Frame 5, by the same lights: the pictures differ by how they are asked, and edges alone.
  const auto all = [&](const char* file) { return boxes(load_image(folder_ / file), 8, 6); };
  EXPECT_GT(correlation(all("igi.exr"), all("tic.exr")), 0.98);
  // The window shows the picture, where the panel, top left, does not cover it.
  const std::vector<double> shown = all("tic.png"), sent = all("tic.exr");
  const auto below = [](const std::vector<double>& v) {
    return std::vector<double>(v.begin() + 3 * 8 * 4, v.end());
  };
  EXPECT_GT(correlation(below(shown), below(sent)), 0.9);
}

}  // namespace
}  // namespace haarlight::fixtures
