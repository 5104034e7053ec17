// Reading by place.

#include "core/input_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "core/error.h"

namespace haarlight {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, int error_number) {
  throw Error(error_number == ENOENT ? ErrorKind::missing : ErrorKind::io,
              fmt::format("{}: {}", file.string(), std::generic_category().message(error_number)));
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& file) : file_(file) {
  // Without O_NONBLOCK a pipe under this name would wait for its writer.
  descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0) refuse(file, errno);
  struct stat status {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  if (!known || !S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw Error(ErrorKind::io, fmt::format("{}: not a plain file", file.string()));
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile() { ::close(descriptor_); }

void InputFile::read(std::uint64_t offset, std::span<std::byte> bytes) const {
  constexpr std::size_t kMost = std::size_t{1} << 30;  // the system takes no more than 2 GiB a call
  while (!bytes.empty()) {
    const ssize_t n = ::pread(descriptor_, bytes.data(), std::min(bytes.size(), kMost),
                              static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) refuse(file_, errno);
    if (n == 0) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: ends at byte {}, expected {} bytes more: the file was cut short",
                              file_.string(), offset, bytes.size()));
    }
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
}

}  // namespace haarlight
