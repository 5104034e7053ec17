// Bytes as files, and what counts as a fault.

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>

#include "core/error.h"
#include "tests/core/temporary_folder.h"
#include "tests/fuzz/targets.h"

namespace haarlight::fuzz {

void fault(const std::string& what) {
  fmt::print(stderr, "fault: {}\n", what);
  std::abort();
}

Outcome with_file(const std::string& name, Bytes bytes,
                  const std::function<void(const std::filesystem::path&)>& use) {
  static const auto folder = [] {
    // In memory: a million files are no work for a disk. An old folder is left to the system.
    std::error_code error;
    if (std::filesystem::is_directory("/dev/shm", error) && !std::getenv("TMPDIR")) {
      ::setenv("TMPDIR", "/dev/shm", 1);
      auto made = std::make_unique<TemporaryFolder>();
      ::unsetenv("TMPDIR");
      return made;
    }
    return std::make_unique<TemporaryFolder>();
  }();
  const std::filesystem::path file = *folder / name;
  write_bytes(file, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  try {
    use(file);
  } catch (const Error& error) {
    const std::string what = error.what();
    if (what.find(name) == std::string::npos) fault("an error that names no file: " + what);
    if (what.find('\n') != std::string::npos) fault("an error of several lines: " + what);
    return Outcome::refused;
  } catch (const std::exception& error) {
    fault(std::string("an exception that is no Error: ") + error.what());
  }
  return Outcome::accepted;
}

}  // namespace haarlight::fuzz
