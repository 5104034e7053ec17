// haarlight-view without a window.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/image_io.h"
#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"
#include "tests/viewer/inputs.h"

namespace haarlight::fixtures {
namespace {

class ViewProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    ::unsetenv("DISPLAY");
    ::unsetenv("WAYLAND_DISPLAY");
    write_small_transport(folder_ / "t.hlt");
    write_sky(folder_ / "a.exr", 1);
    write_sky(folder_ / "b.exr", 2);
  }
  ProgramResult view(std::vector<std::string> words) { return run_program(words, folder_.path()); }
  TemporaryFolder folder_;
};

void expect_one_line(const ProgramResult& result, int code, const std::string& part) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(result.err.rfind("haarlight-view: ", 0), 0u) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

TEST_F(ViewProgram, RunsWithoutADisplay) {
  const ProgramResult result =
      view({"t.hlt", "--env", "a.exr", "--frames", "12", "--motion", "rotate", "--screenshot",
            "p.png", "--exr", "p.exr", "--metrics", "m.csv", "--timings"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("relight_ms "), std::string::npos) << result.out;
  EXPECT_EQ(load_image(folder_ / "p.png").width, 24);
  EXPECT_EQ(load_image(folder_ / "p.exr").height, 16);
  EXPECT_EQ(read_table(folder_ / "m.csv").rows.size(), 12u);
}

// The last picture of the session is that of `haarlight relight` at the same frame.
TEST_F(ViewProgram, DrawsWhatRelightDraws) {
  ASSERT_EQ(
      view({"t.hlt", "--env", "a.exr", "--frames", "8", "--exr", "v.exr", "--wavelets", "9"}).code,
      0);
  const std::string command =
      std::string("cd '") + folder_.path().string() +
      "' && " HAARLIGHT_RELIGHT
      " relight t.hlt --env a.exr --frames 8 --wavelets 9 -o r --formats exr 2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(load_image(folder_ / "v.exr").pixels,
            load_image(folder_ / "r" / "frame_0007.exr").pixels);
}

TEST_F(ViewProgram, ARecordingIsReplayedByRelightWithTheSameNumbers) {
  ASSERT_EQ(view({"t.hlt", "--env", "a.exr", "--env-to", "b.exr", "--motion", "blend", "--frames",
                  "20", "--record", "m.json", "--metrics", "v.csv", "--method", "nwa", "--ms",
                  "0.05", "--compare", "split"})
                .code,
            0);
  const std::string command = std::string("cd '") + folder_.path().string() +
                              "' && " HAARLIGHT_RELIGHT
                              " relight t.hlt --motion m.json --metrics r.csv --against-reference "
                              "2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const Table recorded = read_table(folder_ / "v.csv"), replayed = read_table(folder_ / "r.csv");
  ASSERT_EQ(recorded.rows.size(), 20u);
  ASSERT_EQ(replayed.rows.size(), 20u);
  for (std::size_t i = 0; i < 20; ++i) {
    for (const char* column : {"frame", "method", "wavelets", "weight", "updates", "resets",
                               "lighting_error", "image_rel_rmse", "image_max_abs"}) {
      EXPECT_EQ(recorded.rows[i].at(column), replayed.rows[i].at(column)) << column << " " << i;
    }
  }
}

TEST_F(ViewProgram, SaysInOneLineWhatIsWrong) {
  expect_one_line(view({"t.hlt", "--env", "a.exr"}), 1,
                  HAARLIGHT_HAS_WINDOW ? "DISPLAY" : "without a window");
  // Of a display that is not there a program without a window knows nothing.
  ::setenv("DISPLAY", ":nowhere", 1);
  const ProgramResult nowhere = view({"t.hlt", "--env", "a.exr", "--frames", "2", "--no-memory"});
  ::unsetenv("DISPLAY");
  if (HAARLIGHT_HAS_WINDOW) {
    expect_one_line(nowhere, 1, "cannot open a window");
  } else {
    EXPECT_EQ(nowhere.code, 0) << nowhere.err;
  }
  expect_one_line(view({"t.hlt", "--env", "a.exr", "--headless"}), 2, "--frames");
  expect_one_line(view({"--frames", "3"}), 1, "--env");
  expect_one_line(view({"none.hlt", "--env", "a.exr", "--frames", "3"}), 1, "none.hlt");
  expect_one_line(view({"t.hlt", "--env", "t.hlt", "--frames", "3"}), 1, "t.hlt");
  expect_one_line(view({"t.hlt", "--env", "a.exr", "--frames", "0"}), 2, "--frames");
  expect_one_line(view({"t.hlt", "--motion", "jump"}), 2, "jump");
  expect_one_line(view({"t.hlt", "--size", "12"}), 2, "--size");
  expect_one_line(view({"t.hlt", "--exposure", "nan"}), 2, "--exposure");
  expect_one_line(view({"t.hlt", "--ms", "3", "--wavelets", "3"}), 2, "--ms");
  expect_one_line(view({"t.hlt", "--env", "a.exr", "--frames", "3", "--metrics", "no/m.csv"}), 1,
                  "no/m.csv");
}

TEST_F(ViewProgram, HelpNamesTheOptions) {
  const ProgramResult help = view({"--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* name : {"--env", "--motion", "--ms", "--frames", "--headless", "--script"}) {
    EXPECT_NE(help.out.find(name), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace haarlight::fixtures
