// Files that appear whole or not at all: temporary, fsync, rename, fsync of the folder.

#include "core/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>

#include "core/error.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& file, const char* what, int error_number) {
  throw Error(ErrorKind::io, fmt::format("{}: {}: {}", file.string(), what,
                                         std::generic_category().message(error_number)));
}

/// The place a rename must go to. A link is followed, so that the link stays and its target is
/// replaced; anything that is not a plain file (a folder, /dev/null) must not be renamed over.
fs::path rename_target(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) return file;
  if (fs::is_directory(status)) fail(file, "cannot write a file here", EISDIR);
  if (!fs::is_regular_file(status)) {
    throw Error(ErrorKind::io, fmt::format("{}: is a device or pipe, expected a plain file or none",
                                           file.string()));
  }
  if (!fs::is_symlink(fs::symlink_status(file, error))) return file;
  fs::path target = fs::canonical(file, error);
  if (error) fail(file, "cannot follow the link", error.value());
  return target;
}

/// ".name.tmp-PID-N.suffix" beside the final file; process and counter keep names apart.
fs::path temporary_name(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  const std::string name = fmt::format(".{}.tmp-{}-{}{}", target.stem().string(), ::getpid(),
                                       counter.fetch_add(1), target.extension().string());
  return target.parent_path() / name;
}

/// Creates the temporary, skipping names left by a dead process of the same number.
int create_temporary(const fs::path& target, const fs::path& named_by_caller, fs::path& temporary) {
  for (int attempt = 0;; ++attempt) {
    temporary = temporary_name(target);
    const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) return descriptor;
    if (errno != EEXIST || attempt == 1000) fail(named_by_caller, "cannot create", errno);
  }
}

/// Makes the rename itself last through a power cut. Some file systems cannot sync a folder and
/// say EINVAL; there is nothing better to do there.
void sync_folder_of(const fs::path& target, const fs::path& named_by_caller) {
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) fail(named_by_caller, "cannot open its folder", errno);
  const int result = ::fsync(descriptor);
  const int error_number = errno;
  ::close(descriptor);
  if (result != 0 && error_number != EINVAL && error_number != EROFS) {
    fail(named_by_caller, "cannot sync its folder", error_number);
  }
}

void write_fully(int descriptor, std::uint64_t offset, const void* bytes, std::size_t size,
                 const fs::path& named_by_caller) {
  const char* next = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = ::pwrite(descriptor, next, size, static_cast<off_t>(offset));
    if (written < 0) {
      if (errno == EINTR) continue;
      fail(named_by_caller, "cannot write", errno);
    }
    next += written;
    offset += static_cast<std::uint64_t>(written);
    size -= static_cast<std::size_t>(written);
  }
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& final_path)
    : final_path_(final_path), target_path_(rename_target(final_path)) {
  descriptor_ = create_temporary(target_path_, final_path_, temporary_path_);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_path_.c_str());
}

void AtomicFile::write(const void* bytes, std::size_t size) { write_at(size_, bytes, size); }

void AtomicFile::write_at(std::uint64_t offset, const void* bytes, std::size_t size) {
  if (descriptor_ < 0) fail(final_path_, "cannot write after commit", EBADF);
  write_fully(descriptor_, offset, bytes, size, final_path_);
  size_ = std::max(size_, offset + size);
}

void AtomicFile::commit() {
  if (descriptor_ < 0) fail(final_path_, "cannot commit twice", EBADF);
  if (::fsync(descriptor_) != 0) fail(final_path_, "cannot sync", errno);
  if (::rename(temporary_path_.c_str(), target_path_.c_str()) != 0) {
    fail(final_path_, "cannot rename into place", errno);
  }
  // From here the name is taken: the destructor has nothing left to remove.
  const int result = ::close(descriptor_);
  descriptor_ = -1;
  if (result != 0) fail(final_path_, "cannot close", errno);
  sync_folder_of(target_path_, final_path_);
}

}  // namespace haarlight
