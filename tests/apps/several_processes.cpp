// Several processes under mpirun make what one makes, and fail as one.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"

namespace haarlight {
namespace {

using fixtures::ProgramResult;

const std::vector<std::string> kFour{HAARLIGHT_MPIEXEC, "--allow-run-as-root", "--oversubscribe",
                                     "-n", "4"};

std::vector<std::string> words(const std::string& scene, const std::string& output) {
  return {"precompute", scene, "-o", output, "--size", "64x64", "--face", "16", "--threads", "2"};
}

// Those that a process has started and that have not ended.
std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream in(entry.path() / "stat");
    pid_t id = 0, of = 0;
    std::string name;
    char state = 0;
    // "PID (NAME) STATE PARENT ...": the name of what is looked for has no space.
    if (in >> id >> name >> state >> of && of == parent && state != 'Z') children.push_back(id);
  }
  return children;
}

/// Open MPI keeps memory to the end, in libraries that it has unloaded by then: a sanitizer that
/// looks for leaks can no longer tell whose it is. What is ours is looked for where one process
/// runs.
class SeveralProcesses : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const char* given = std::getenv("ASAN_OPTIONS");
    const std::string options = (given ? std::string(given) + ":" : "") + "fast_unwind_on_malloc=0";
    ::setenv("ASAN_OPTIONS", options.c_str(), 1);
  }
};

TEST_F(SeveralProcesses, MakeTheBytesOfOne) {
  const fixtures::TemporaryFolder folder;
  fixtures::write_table_scene(folder / "table.obj");
  ASSERT_EQ(fixtures::run_program(words("table.obj", "one.hlt"), folder.path()).code, 0);
  const ProgramResult four =
      fixtures::Program(words("table.obj", "four.hlt"), folder.path(), kFour).wait();
  EXPECT_EQ(four.code, 0) << four.err;
  EXPECT_EQ(fixtures::read_bytes(folder / "four.hlt"), fixtures::read_bytes(folder / "one.hlt"));
  // One speaks.
  EXPECT_EQ(four.out.find("four.hlt:"), four.out.rfind("four.hlt:")) << four.out;
}

TEST_F(SeveralProcesses, FailWithOneMessage) {
  const fixtures::TemporaryFolder folder;
  const ProgramResult result =
      fixtures::Program(words("absent.obj", "a.hlt"), folder.path(), kFour).wait();
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("haarlight: absent.obj"), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("haarlight: "), result.err.rfind("haarlight: ")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "a.hlt"));
}

// A process that is killed in the middle of the run takes the others along: mpirun ends, no file
// claims to be complete, and what was done is taken up by the next run.
TEST_F(SeveralProcesses, OneThatIsKilledEndsAllAndLosesNothing) {
  const fixtures::TemporaryFolder folder;
  fixtures::write_table_scene(folder / "table.obj");
  std::vector<std::string> run = words("table.obj", "a.hlt");
  run[5] = "128x128", run[7] = "32";
  fixtures::Program four(run, folder.path(), kFour);
  // Ranks are the children of mpirun: one of them is killed once there is a journal.
  const auto partial = folder / "a.hlt.partial";
  for (int i = 0; i < 3000 && !std::filesystem::exists(partial); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ASSERT_TRUE(std::filesystem::exists(partial));
  const std::vector<pid_t> ranks = children_of(four.pid());
  ASSERT_EQ(ranks.size(), 4u);
  ::kill(ranks[2], SIGKILL);
  const ProgramResult result = four.wait();
  EXPECT_NE(result.code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.hlt"));
  EXPECT_TRUE(std::filesystem::exists(partial));
  run.push_back("--resume");
  EXPECT_EQ(fixtures::run_program(run, folder.path()).code, 0);
  run[3] = "b.hlt";
  run.pop_back();
  EXPECT_EQ(fixtures::run_program(run, folder.path()).code, 0);
  EXPECT_EQ(fixtures::read_bytes(folder / "a.hlt"), fixtures::read_bytes(folder / "b.hlt"));
}

}  // namespace
}  // namespace haarlight
