// Tries output places by making a temporary there and removing it.

#include "apps/outputs.h"

#include <fmt/format.h>

#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"

namespace haarlight {

void require_writable_file(const std::filesystem::path& file) { AtomicFile probe(file); }

void require_writable_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw Error(ErrorKind::io,
                fmt::format("{}: cannot make this folder: {}", folder.string(), error.message()));
  }
  if (!std::filesystem::is_directory(folder)) {
    throw Error(ErrorKind::io,
                fmt::format("{}: is not a folder, expected one for the pictures", folder.string()));
  }
  require_writable_file(folder / "frame");
}

}  // namespace haarlight
