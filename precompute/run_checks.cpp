// What is refused before minutes of work.

#include "precompute/run_checks.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>

#include "core/error.h"

namespace haarlight {

void check(const RunOptions& options) {
  if (!(options.error >= 0) || !(options.error < 1)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("error is {}, expected 0 or more and below 1", options.error));
  }
  if (!(options.time_limit >= 0)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("time limit is {} s, expected 0 or more", options.time_limit));
  }
  const Shard& shard = options.shard;
  if (shard.index < 1 || shard.index > shard.count) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("shard {} of {}, expected 1 of 1 or more up to n of n", shard.index,
                            shard.count));
  }
}

void check(const Camera& camera) {
  if (camera.width < 1 || camera.height < 1 || camera.width > 16384 || camera.height > 16384) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture size is {}x{}, expected 1x1 to 16384x16384", camera.width,
                            camera.height));
  }
  const auto& rows = camera.orientation.row;
  for (const Vec3& v : {camera.position, rows[0], rows[1], rows[2]}) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("the camera's place or orientation holds ({}, {}, {}), expected "
                              "finite numbers",
                              v.x, v.y, v.z));
    }
  }
  if (!(camera.vertical_fov > 0) || !(camera.vertical_fov < kPi)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("vertical field of view is {} rad, expected above 0 and below pi",
                            camera.vertical_fov));
  }
}

void check_output(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code code;
  if (!std::filesystem::is_directory(folder, code)) {
    throw Error(ErrorKind::io, fmt::format("{}: there is no folder {}, expected one to write to",
                                           file.string(), folder.string()));
  }
  if (std::filesystem::is_directory(file, code) || access(folder.c_str(), W_OK) != 0) {
    throw Error(ErrorKind::io,
                fmt::format("{}: cannot be written, expected a file name in a folder that is open "
                            "for writing",
                            file.string()));
  }
}

}  // namespace haarlight
