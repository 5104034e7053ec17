// Row 43, of scenes: models that are broken on purpose, and scenes damaged at random.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "precompute/scene_import.h"
#include "tests/fuzz/seeds.h"
#include "tests/fuzz/targets.h"
#include "tests/hard/hard_case.h"

namespace haarlight {
namespace {

using namespace hard;
namespace fs = std::filesystem;

enum class End { taken, refused, crashed };

/// What `use` comes to, in a process of its own: readers of others may crash, and that counts.
template <typename Use>
End in_own_process(const Use& use, unsigned seconds) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::alarm(std::getenv("HAARLIGHT_SANITIZED") ? 20 * seconds : seconds);
    // Readers of others talk.
    const int quiet = ::open("/dev/null", O_WRONLY);
    ::dup2(quiet, STDOUT_FILENO);
    ::dup2(quiet, STDERR_FILENO);
    ::_exit(use());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (!WIFEXITED(status)) return End::crashed;
  return WEXITSTATUS(status) == 0   ? End::taken
         : WEXITSTATUS(status) == 1 ? End::refused
                                    : End::crashed;
}

TEST(HardCases, Row43_BrokenModels) {
  property("assimp's own test models, broken ones among them, are scenes or errors, not crashes");
  const fs::path folder = "/usr/share/assimp";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no package assimp-testmodels";
  set_thread_count(1);
  int models = 0, taken = 0, crashed = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    std::string suffix = entry.path().extension().string();
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    if (suffix != ".gltf" && suffix != ".glb" && suffix != ".obj" && suffix != ".ply") continue;
    const End end = in_own_process(
        [&] {
          try {
            import_scene(entry.path());
            return 0;
          } catch (const Error&) {
            return 1;
          } catch (...) {
            return 2;
          }
        },
        20);
    ++models;
    taken += end == End::taken;
    crashed += end == End::crashed;
    EXPECT_NE(end, End::crashed) << entry.path();
  }
  at_most("crashes", crashed, 0);
  at_least("models", models, 50);
  at_least("taken", taken, 20);
}

// Rounds of 100 seeds with a few bytes changed, each round in a process of its own. Returns how
// many crashed or hung.
int crashes_of_damaged(const std::vector<std::string>& seeds, std::size_t first_byte, int rounds,
                       fuzz::Outcome (*target)(fuzz::Bytes)) {
  std::mt19937_64 random(430);
  target(std::as_bytes(std::span(seeds.back())));  // its folder is this process's, and goes
  int crashed = 0;
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::string> damaged;
    for (std::size_t i = 0; i < 100; ++i) {
      std::string bytes = seeds[i % seeds.size()];
      for (std::uint64_t change = 0, changes = 1 + random() % 4; change < changes; ++change) {
        const std::size_t at = first_byte + random() % (bytes.size() - first_byte);
        if (random() % 3 == 0) {
          bytes.erase(at, 1 + random() % 20);
        } else if (random() % 2 == 0) {
          bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
        } else {
          // Digits are what sizes and indices are made of.
          bytes[at] = static_cast<char>('0' + random() % 10);
        }
        if (bytes.size() < 2) break;
      }
      damaged.push_back(std::move(bytes));
    }
    const End end = in_own_process(
        [&] {
          for (const std::string& bytes : damaged) target(std::as_bytes(std::span(bytes)));
          return 0;
        },
        60);
    crashed += end == End::crashed;
  }
  return crashed;
}

TEST(HardCases, Row43_ScenesDamaged) {
  property("scenes with any bytes changed are scenes or errors, not crashes");
  set_thread_count(1);
  const int rounds = full() ? 400 : 20;
  // The first byte says which format.
  at_most("crashes", crashes_of_damaged(fuzz::scene_seeds(), 1, rounds, fuzz::scene), 0);
  at_least("scenes", 100 * rounds, 2000);
}

TEST(HardCases, Row43_AnimationsDamaged) {
  property("scenes that move with any bytes changed are such or errors, not crashes");
  set_thread_count(1);
  const int rounds = full() ? 400 : 20;
  at_most("crashes", crashes_of_damaged(fuzz::animation_seeds(), 0, rounds, fuzz::animation), 0);
  at_least("scenes", 100 * rounds, 2000);
}

}  // namespace
}  // namespace haarlight
