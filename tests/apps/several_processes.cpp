// Several processes under mpirun make what one makes, and fail as one.

#include <gtest/gtest.h>

#include <string>
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

TEST(SeveralProcesses, MakeTheBytesOfOne) {
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

TEST(SeveralProcesses, FailWithOneMessage) {
  const fixtures::TemporaryFolder folder;
  const ProgramResult result =
      fixtures::Program(words("absent.obj", "a.hlt"), folder.path(), kFour).wait();
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.err.find("haarlight: absent.obj"), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("haarlight: "), result.err.rfind("haarlight: ")) << result.err;
  EXPECT_FALSE(std::filesystem::exists(folder / "a.hlt"));
}

}  // namespace
}  // namespace haarlight
