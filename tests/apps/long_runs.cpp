// What can befall a long precomputation: kills, full disks, too little memory, slices, other
// scenes.

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;
using fixtures::Program;
using fixtures::ProgramResult;
using fixtures::read_bytes;
using fixtures::write_bytes;
using Json = nlohmann::json;

class LongRuns : public testing::Test {
 protected:
  LongRuns() { fixtures::write_table_scene(path("table.obj")); }
  fs::path path(const std::string& name) const { return folder_.path() / name; }
  std::vector<std::string> words(const std::string& output,
                                 const std::vector<std::string>& more = {}) const {
    std::vector<std::string> all{"precompute", "table.obj", "-o",           output,  "--size",
                                 "96x96",      "--face",    "16",           "--spp", "8",
                                 "--threads",  "2",         "--uniform-spp"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  ProgramResult run(const std::vector<std::string>& arguments) const {
    return fixtures::run_program(arguments, folder_.path());
  }
  Json info(const std::string& file) const {
    return Json::parse(run({"info", file, "--json"}).out);
  }

  fixtures::TemporaryFolder folder_;
};

TEST_F(LongRuns, KilledAtAnyMomentItGoesOnToTheSameBytes) {
  const auto start = std::chrono::steady_clock::now();
  ASSERT_EQ(run(words("whole.hlt")).code, 0);
  double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> moment(0.2, 0.9);
  int kills = 0;
  for (int round = 0; round < 6; ++round) {
    Program program(words("killed.hlt", {"--resume"}), folder_.path());
    std::this_thread::sleep_for(std::chrono::duration<double>(whole * moment(random)));
    if (program.running()) {
      program.kill();
      ++kills;
    } else {
      whole /= 2;  // the machine was busier before
    }
    program.wait();
    // Under the final name there is nothing, or all.
    if (fs::exists(path("killed.hlt"))) {
      EXPECT_EQ(read_bytes(path("killed.hlt")), read_bytes(path("whole.hlt")));
    }
  }
  EXPECT_GT(kills, 0);
  const ProgramResult last = run(words("killed.hlt", {"--resume"}));
  EXPECT_EQ(last.code, 0) << last.err;
  EXPECT_EQ(read_bytes(path("killed.hlt")), read_bytes(path("whole.hlt")));
}

TEST_F(LongRuns, AFullDiskLeavesTheOldFileAndAMessage) {
  ASSERT_EQ(run(words("a.hlt")).code, 0);
  const std::string before = read_bytes(path("a.hlt"));
  // A limit of size is a disk that fills up: first while tiles are journalled, then not before the
  // file is put together.
  rlimit old{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  for (const rlim_t most : {rlim_t{100'000}, static_cast<rlim_t>(before.size() - 1000)}) {
    rlimit tight = old;
    tight.rlim_cur = most;
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &tight), 0);
    const ProgramResult full = run(words("a.hlt", {"--error", "0.012"}));
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old), 0);
    EXPECT_EQ(full.code, 1);
    EXPECT_NE(full.err.find("a.hlt"), std::string::npos) << full.err;
    EXPECT_NE(full.err.find("File too large"), std::string::npos) << full.err;
    EXPECT_EQ(read_bytes(path("a.hlt")), before);
  }
  // With room again it goes on.
  const ProgramResult rest = run(words("a.hlt", {"--error", "0.012", "--resume"}));
  EXPECT_EQ(rest.code, 0) << rest.err;
  EXPECT_NE(rest.out.find("were there already"), std::string::npos) << rest.out;

  fs::create_symlink("/dev/full", path("b.hlt.partial"));
  const ProgramResult device = run(words("b.hlt"));
  EXPECT_EQ(device.code, 1);
  EXPECT_NE(device.err.find("b.hlt.partial"), std::string::npos) << device.err;
}

TEST_F(LongRuns, MemoryStaysBelowItsLimit) {
  // At 64 texels a worker takes a hundred MiB; sixteen of them are not to be had.
  const auto limited = [&](const std::string& memory) {
    return run({"precompute", "table.obj", "-o", "a.hlt", "--size", "32x32", "--face", "64",
                "--spp", "1", "--threads", "16", "--memory", memory});
  };
  // Sanitizers keep what is freed, and shadows of all.
  const int most_mib = std::getenv("HAARLIGHT_SANITIZED") ? 2000 : 600;
  const ProgramResult few = limited(std::to_string(most_mib) + "M");
  EXPECT_EQ(few.code, 0) << few.err;
  EXPECT_LT(few.peak_kib, most_mib * 1024);
  const ProgramResult none = limited("60M");
  EXPECT_EQ(none.code, 1);
  EXPECT_NE(none.err.find("memory of 60 MiB is too little, expected at least"), std::string::npos)
      << none.err;
}

TEST_F(LongRuns, SlicesAreJoined) {
  ASSERT_EQ(run(words("whole.hlt")).code, 0);
  for (const char* slice : {"1/2", "2/2"}) {
    const ProgramResult made = run(words("joined.hlt", {"--shard", slice}));
    EXPECT_EQ(made.code, 0) << made.err;
  }
  const ProgramResult lacking = run({"merge", "joined.hlt", "joined.hlt.shard-1-of-2"});
  EXPECT_EQ(lacking.code, 1);
  EXPECT_NE(lacking.err.find("shard 2 of 2 was not given"), std::string::npos) << lacking.err;
  const ProgramResult joined =
      run({"merge", "joined.hlt", "joined.hlt.shard-2-of-2", "joined.hlt.shard-1-of-2"});
  EXPECT_EQ(joined.code, 0) << joined.err;
  EXPECT_EQ(read_bytes(path("joined.hlt")), read_bytes(path("whole.hlt")));
}

TEST_F(LongRuns, InfoSaysWhetherTheSceneIsStillTheSame) {
  write_bytes(path("table.mtl"), "newmtl wood\nKd 0.5 0.3 0.1\n");
  write_bytes(path("table.obj"), "mtllib table.mtl\n" + read_bytes(path("table.obj")));
  ASSERT_EQ(run(words("a.hlt")).code, 0);
  EXPECT_EQ(info("a.hlt").at("scene"), "unchanged");
  EXPECT_EQ(info("a.hlt").at("complete"), true);
  write_bytes(path("table.mtl"), "newmtl wood\nKd 0.5 0.3 0.2\n");
  EXPECT_EQ(info("a.hlt").at("scene"), "changed");
  write_bytes(path("table.mtl"), "newmtl wood\nKd 0.5 0.3 0.1\n");
  EXPECT_EQ(info("a.hlt").at("scene"), "unchanged");
  // The scene may move with the file, and is found from anywhere.
  fs::create_directory(path("elsewhere"));
  for (const char* name : {"table.obj", "table.mtl", "a.hlt"}) {
    fs::rename(path(name), path("elsewhere") / name);
  }
  EXPECT_EQ(info("elsewhere/a.hlt").at("scene"), "unchanged");
  fs::remove(path("elsewhere/table.obj"));
  EXPECT_EQ(info("elsewhere/a.hlt").at("scene"), "not found");
}

TEST_F(LongRuns, AtTheTimeLimitThereIsAFileToRelight) {
  save_image(path("room.exr"), fixtures::room_environment());
  const ProgramResult cut =
      run({"precompute", "table.obj", "-o", "cut.hlt", "--size", "256x256", "--face", "32", "--spp",
           "64", "--uniform-spp", "--time-limit", "1.5"});
  EXPECT_EQ(cut.code, 0) << cut.err;
  EXPECT_NE(cut.err.find("cut.hlt: incomplete: "), std::string::npos) << cut.err;
  EXPECT_EQ(info("cut.hlt").at("complete"), false);
  const ProgramResult lit = run({"relight", "cut.hlt", "--env", "room.exr", "--motion", "still",
                                 "--frames", "1", "-o", "out"});
  EXPECT_EQ(lit.code, 0) << lit.err;
  EXPECT_NE(lit.err.find("cut.hlt: incomplete: "), std::string::npos) << lit.err;
  EXPECT_TRUE(fs::exists(path("out/frame_0000.png")));
}

}  // namespace
}  // namespace haarlight
