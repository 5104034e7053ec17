// Rows 46 to 48: disks that are full or fail, programs that are killed, power that goes.

#include <gtest/gtest.h>

#include <cerrno>
#include <chrono>
#include <map>
#include <random>
#include <thread>

#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"
#include "tests/hard/crash_states.h"
#include "tests/hard/hard_case.h"

namespace haarlight {
namespace {

using namespace hard;
namespace fs = std::filesystem;
using fixtures::Program;
using fixtures::ProgramResult;
using Files = std::map<std::string, std::string>;

/// A command whose outputs lie in out/ below its folder.
struct Command {
  std::string name;
  std::vector<std::string> words;    ///< the program's arguments, or all words if `program` is set
  std::string program;               ///< empty: haarlight
  std::vector<std::string> outputs;  ///< names in out/
};

/// The environment that fault_shim.cpp reads, for as long as this lives.
class Shim {
 public:
  Shim(const fs::path& under, const std::string& fault, const fs::path& log = {}) {
    ::setenv("LD_PRELOAD", HAARLIGHT_FAULT_SHIM, 1);
    ::setenv("HAARLIGHT_FAULT_UNDER", under.c_str(), 1);
    ::setenv("HAARLIGHT_FAULT", fault.c_str(), 1);
    if (!log.empty()) ::setenv("HAARLIGHT_FAULT_LOG", log.c_str(), 1);
  }
  ~Shim() {
    for (const char* name :
         {"LD_PRELOAD", "HAARLIGHT_FAULT_UNDER", "HAARLIGHT_FAULT", "HAARLIGHT_FAULT_LOG"}) {
      ::unsetenv(name);
    }
  }
  Shim(const Shim&) = delete;
  Shim& operator=(const Shim&) = delete;
};

class HardCases : public testing::Test {
 protected:
  HardCases() {
    fixtures::write_table_scene(folder_ / "table.obj");
    save_image(folder_ / "room.exr", fixtures::room_environment());
    // Sanitizers want to be first among libraries; the shim only wants to be there.
    const char* options = std::getenv("ASAN_OPTIONS");
    ::setenv("ASAN_OPTIONS",
             (std::string(options ? options : "") + ":verify_asan_link_order=0").c_str(), 1);
  }

  fs::path out() const { return folder_ / "out"; }

  Command precompute(const std::vector<std::string>& more = {}) const {
    Command c{"precompute",
              {"precompute", "table.obj", "-o", "out/a.hlt", "--size", "24x24", "--face", "4",
               "--spp", "2", "--threads", "2", "--uniform-spp", "--effects", "shadows"},
              "",
              {"a.hlt"}};
    c.words.insert(c.words.end(), more.begin(), more.end());
    return c;
  }
  Command relight() const {
    return {"relight",
            {"relight", "made.hlt", "--env", "room.exr", "--frames", "2", "--formats", "exr,png",
             "--metrics", "out/m.csv", "-o", "out", "--threads", "1"},
            "",
            {"m.csv", "frame_0000.exr", "frame_0000.png", "frame_0001.exr", "frame_0001.png"}};
  }
  Command writer(const std::string& file) const {
    return {"writing " + file, {"out/" + file}, HAARLIGHT_FAULT_WRITER, {file}};
  }

  ProgramResult run(const Command& command) const { return start(command)->wait(); }
  std::unique_ptr<Program> start(const Command& command) const {
    return std::make_unique<Program>(command.words, folder_.path(), std::vector<std::string>{},
                                     command.program.empty() ? HAARLIGHT_PROGRAM : command.program);
  }

  void fresh(const Files& before) const {
    fs::remove_all(out());
    fs::create_directory(out());
    for (const auto& [name, bytes] : before) write_bytes(out() / name, bytes);
  }
  Files now() const {
    Files files;
    for (const auto& entry : fs::directory_iterator(out())) {
      files[entry.path().filename().string()] = read_bytes(entry.path());
    }
    return files;
  }
  /// What a killed program was writing stays under its temporary name, beside what is right.
  Files now_without_temporaries() const {
    Files files = now();
    std::erase_if(files,
                  [](const auto& file) { return file.first.find(".tmp-") != std::string::npos; });
    return files;
  }
  /// What a run without faults leaves. Times differ from run to run: metrics are compared by name.
  Files right(const Command& command) const {
    fresh({});
    const ProgramResult result = run(command);
    EXPECT_EQ(result.code, 0) << command.name << ": " << result.err;
    return now();
  }
  /// Something else under all names of outputs.
  static Files old_files(const Command& command) {
    Files old;
    for (const std::string& name : command.outputs) old[name] = "old " + name;
    return old;
  }
  /// Metrics hold times; they count as whole by their number of lines.
  static bool same_file(const std::string& name, const std::string& a, const std::string& b) {
    if (!name.ends_with(".csv")) return a == b;
    return std::count(a.begin(), a.end(), '\n') == std::count(b.begin(), b.end(), '\n') &&
           a.starts_with(b.substr(0, b.find('\n')));
  }

  std::vector<Command> commands() {
    Command made = precompute();
    fs::create_directory(out());
    EXPECT_EQ(run(made).code, 0);
    fs::copy_file(out() / "a.hlt", folder_ / "made.hlt");
    return {precompute(), relight(), writer("r.json"), writer("p.hdr")};
  }

  TemporaryFolder folder_;
};

std::string call_name(LogOp op) {
  switch (op) {
    case LogOp::create:
      return "create";
    case LogOp::write:
      return "write";
    case LogOp::truncate:
      return "truncate";
    case LogOp::sync:
    case LogOp::sync_folder:
      return "sync";
    case LogOp::rename:
      return "rename";
    case LogOp::remove:
      break;
  }
  return {};
}

TEST_F(HardCases, Row46_EveryCallThatWritesFails) {
  property(
      "create, write, sync, rename failing at every call, once and for ever: exit code 1, a "
      "message that names the file, old files intact");
  int runs = 0, taken_for_done = 0, unnamed = 0, third = 0, left_over = 0;
  for (const Command& command : commands()) {
    const Files whole = right(command), old = old_files(command);
    fresh(old);
    {
      const Shim shim(out(), "", folder_ / "log");
      ASSERT_EQ(run(command).code, 0);
    }
    std::map<std::string, int> calls;
    for (const LoggedOp& op : read_log(folder_ / "log")) ++calls[call_name(op.entry.op)];
    fs::remove(folder_ / "log");
    for (const auto& [call, count] : calls) {
      if (call.empty()) continue;
      // The appends to a journal are alike, and so are those to a table; the suite tries fewer.
      const bool slow = command.program.empty() && !full();
      for (int n = 1; n <= count; n += slow && n > 2 && n < count - 8 ? 3 : 1) {
        for (const bool ever : {false, true}) {
          if (slow && ever == (n % 2 == 0)) continue;  // one of the two
          fresh(old);
          const int error = call == "write" && ever ? ENOSPC : EIO;
          const Shim shim(out(), fmt::format("{}:{}:{}{}", call, error, n, ever ? ":ever" : ""));
          const ProgramResult result = run(command);
          ++runs;
          SCOPED_TRACE(fmt::format("{}: {} {} fails{}: {}", command.name, call, n,
                                   ever ? " and all after it" : "", result.err));
          EXPECT_EQ(result.code, 1);
          taken_for_done += result.code != 1;
          // The file itself, its folder, or what is kept beside it.
          const bool named = result.err.find("out") != std::string::npos;
          EXPECT_TRUE(named);
          unnamed += !named;
          for (const auto& [name, bytes] : now()) {
            if (name.find(".tmp-") != std::string::npos) {
              ++left_over;
              ADD_FAILURE() << name << " was left";
            }
            if (!old.contains(name)) continue;
            const bool known = bytes == old.at(name) || same_file(name, bytes, whole.at(name));
            EXPECT_TRUE(known) << name;
            third += !known;
          }
        }
      }
    }
  }
  at_most("runs that said nothing", taken_for_done, 0);
  at_most("messages without the file", unnamed, 0);
  at_most("outputs neither old nor new", third, 0);
  at_most("temporaries left", left_over, 0);
  at_least("runs", runs, 60);
}

TEST_F(HardCases, Row46_WritesThatTakeHalf) {
  property("a system that writes half of what it was given is asked again: the right bytes");
  int wrong = 0, runs = 0;
  for (const Command& command : commands()) {
    const Files whole = right(command);
    fresh({});
    const Shim shim(out(), "write:short:1:ever");
    const ProgramResult result = run(command);
    EXPECT_EQ(result.code, 0) << result.err;
    for (const std::string& name : command.outputs) {
      ++runs;
      wrong += !same_file(name, read_bytes(out() / name), whole.at(name));
    }
  }
  at_most("wrong files", wrong, 0);
  at_least("files", runs, 8);
}

TEST_F(HardCases, Row47_KilledAndResumed) {
  property(
      "killed at any moment, precompute resumes to the same bytes; every tile that was written "
      "is kept, so that at most the one in hand is lost, a thread");
  const Command command = precompute({"--resume"});
  const Files whole = right(command);
  ASSERT_EQ(whole.size(), 1u);
  std::mt19937_64 random(47);
  int kills = 0, lost = 0, wrong = 0, with_tiles = 0;
  // By counting: at the n-th write, half of which is done. Appends are the writes of a journal.
  const int by_time = full() ? 200 : 4;
  for (int n = 1; n <= 100; ++n) {
    fresh({{"a.hlt", "old"}});
    fs::remove(folder_ / "log");  // the run that resumes keeps one, too
    const Shim shim(out(), fmt::format("write:kill:{}", n), folder_ / "log");
    const ProgramResult killed = run(command);
    if (killed.code != -1) break;  // fewer writes than that
    ++kills;
    int appended = -1;  // the first one is the head
    for (const LoggedOp& op : read_log(folder_ / "log")) {
      appended += op.entry.op == LogOp::write && op.first.ends_with(".partial");
    }
    const Files left = now();
    wrong += left.at("a.hlt") != "old" && left.at("a.hlt") != whole.at("a.hlt");
    ::unsetenv("HAARLIGHT_FAULT");
    const ProgramResult resumed = run(command);
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    // "N of M tiles were there already"
    int kept = 0;
    if (const auto at = resumed.out.find(" tiles were there already"); at != std::string::npos) {
      kept = std::stoi(resumed.out.substr(resumed.out.rfind('\n', at) + 1));
    }
    lost += std::max(0, appended) - kept;
    with_tiles += kept > 0;
    wrong += now_without_temporaries() != whole;
  }
  const auto begin = std::chrono::steady_clock::now();
  fresh({});
  run(command);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::uniform_real_distribution<double> moment(0, seconds);
  for (int n = 0; n < by_time; ++n) {
    fresh({{"a.hlt", "old"}});
    for (int again = 0; again < 2; ++again) {  // once more while it resumes
      const auto program = start(command);
      std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
      if (program->running()) {
        program->kill();
        ++kills;
      }
      program->wait();
      const std::string now_there = read_bytes(out() / "a.hlt");
      wrong += now_there != "old" && now_there != whole.at("a.hlt");
    }
    const ProgramResult resumed = run(command);
    EXPECT_EQ(resumed.code, 0) << resumed.err;
    wrong += now_without_temporaries() != whole;
  }
  at_most("results with other bytes", wrong, 0);
  at_most("written tiles that were lost", lost, 0);
  at_least("kills", kills, full() ? 200 : 8);
  at_least("kills with tiles in the journal", with_tiles, 3);
}

TEST_F(HardCases, Row48_PowerCuts) {
  property(
      "writes not yet synced dropped, torn or reordered: the old file or the new one, never a "
      "third; a journal resumes to the same bytes");
  std::mt19937_64 random(48);
  int states = 0, third = 0, olds = 0, news = 0, resumed_wrong = 0;
  for (const Command& command : commands()) {
    const Files old = old_files(command);
    fresh(old);
    {
      const Shim shim(out(), "", folder_ / "log");
      ASSERT_EQ(run(command).code, 0);
    }
    const Files whole = now();
    Files before;
    for (const auto& [name, bytes] : old) before[(out() / name).string()] = bytes;
    const CrashStates crash(read_log(folder_ / "log"), before);
    fs::remove(folder_ / "log");
    ASSERT_GT(crash.operations(), 4u);

    for (std::size_t count = 0; count <= crash.operations(); ++count) {
      const int rounds = full() ? 400 : 40;
      for (int i = 0; i < rounds; ++i) {
        const Files files = crash.state(count, random);
        ++states;
        for (const auto& [name, bytes] : old) {
          const auto found = files.find((out() / name).string());
          const bool is_old = found != files.end() && found->second == bytes;
          const bool is_new =
              found != files.end() && same_file(name, found->second, whole.at(name));
          olds += is_old;
          news += is_new;
          third += !is_old && !is_new;
        }
        const auto journal = files.find((out() / "a.hlt.partial").string());
        if (journal == files.end() || i % (full() ? 40 : 20) != 0) continue;
        // What is left of the journal is taken up; the result must not show it.
        fresh({});
        for (const auto& [path, bytes] : files) write_bytes(path, bytes);
        const ProgramResult result = run(precompute({"--resume"}));
        resumed_wrong += result.code != 0 || read_bytes(out() / "a.hlt") != whole.at("a.hlt");
      }
    }
  }
  at_most("files neither old nor new", third, 0);
  at_most("resumed to other bytes", resumed_wrong, 0);
  at_least("states", states, 1000);
  at_least("states with an old file", olds, 100);
  at_least("states with a new file", news, 100);
}

}  // namespace
}  // namespace haarlight
