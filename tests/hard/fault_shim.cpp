// Preloaded into a program: makes calls that write fail, stop half way or kill it, and keeps a log
// of what was written. Tests need neither a debugger's rights nor file systems of their own for it.
//
// HAARLIGHT_FAULT_UNDER   folder; other files are left alone
// HAARLIGHT_FAULT         CALL:WHAT:N[:ever], CALL one of create write truncate sync rename, N from
//                         1; WHAT an error number, "short" (half is written, and said so) or
//                         "kill" (half is written, then SIGKILL)
// HAARLIGHT_FAULT_LOG     file to append operations to; see tests/hard/write_log.h

#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <mutex>

#include "tests/hard/write_log.h"

namespace {

using haarlight::hard::LogEntry;
using haarlight::hard::LogOp;

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

using OpenCall = int(const char*, int, ...);
using WriteCall = ssize_t(int, const void*, size_t);
using PwriteCall = ssize_t(int, const void*, size_t, off_t);

/// One call of the program after the other: the log is their order.
std::recursive_mutex one_at_a_time;

struct Plan {
  char call[16] = "";
  bool is_short = false, kills = false, ever = false;
  int error = 0;
  long at = 0;
};

const Plan& plan() {
  static const Plan made = [] {
    Plan p;
    const char* text = getenv("HAARLIGHT_FAULT");
    char what[16] = "", ever[8] = "";
    if (text && sscanf(text, "%15[^:]:%15[^:]:%ld:%7s", p.call, what, &p.at, ever) >= 3) {
      p.is_short = strcmp(what, "short") == 0;
      p.kills = strcmp(what, "kill") == 0;
      p.error = atoi(what);
      p.ever = strcmp(ever, "ever") == 0;
    }
    return p;
  }();
  return made;
}

bool concerns(const char* path) {
  static const char* folder = getenv("HAARLIGHT_FAULT_UNDER");
  return folder && strncmp(path, folder, strlen(folder)) == 0;
}

struct Path {
  char text[4096] = "";
};

Path absolute(const char* path) {
  Path out;
  if (path[0] == '/') {
    snprintf(out.text, sizeof out.text, "%s", path);
  } else if (getcwd(out.text, sizeof out.text)) {
    const size_t length = strlen(out.text);
    snprintf(out.text + length, sizeof out.text - length, "/%s", path);
  }
  return out;
}

Path path_of(int descriptor) {
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  Path out;
  const ssize_t length = readlink(link, out.text, sizeof out.text - 1);
  out.text[length > 0 ? length : 0] = '\0';
  return out;
}

std::uint64_t inode_of(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) == 0 ? status.st_ino : 0;
}

/// Whether this call of `name` is to go wrong. Counts it.
bool strikes(const char* name) {
  static std::atomic<long> count{0};
  if (strcmp(plan().call, name) != 0) return false;
  const long number = ++count;
  return number == plan().at || (plan().ever && number > plan().at);
}

void log(LogOp op, std::uint64_t inode, std::uint64_t offset, const char* first, const void* second,
         std::uint64_t second_size) {
  const char* file = getenv("HAARLIGHT_FAULT_LOG");
  if (!file) return;
  static const int descriptor =
      next<OpenCall>("open")(file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  LogEntry entry{};
  entry.op = op;
  entry.inode = inode;
  entry.offset = offset;
  entry.first = first ? strlen(first) : 0;
  entry.second = second_size;
  static const auto write_out = next<WriteCall>("write");
  static_cast<void>(write_out(descriptor, &entry, sizeof entry));
  if (entry.first > 0) static_cast<void>(write_out(descriptor, first, entry.first));
  if (second_size > 0) static_cast<void>(write_out(descriptor, second, second_size));
}

[[noreturn]] void die() {
  raise(SIGKILL);
  abort();
}

int open_any(const char* path, int flags, mode_t mode) {
  static const auto real = next<OpenCall>("open");
  const Path whole = absolute(path);
  if ((flags & O_CREAT) == 0 || !concerns(whole.text)) return real(path, flags, mode);
  const std::lock_guard lock(one_at_a_time);
  if (strikes("create")) {
    if (plan().kills) die();
    errno = plan().error;
    return -1;
  }
  struct stat status {};
  const bool is_new = stat(path, &status) != 0;
  const int descriptor = real(path, flags, mode);
  if (descriptor >= 0 && is_new)
    log(LogOp::create, inode_of(descriptor), 0, whole.text, nullptr, 0);
  return descriptor;
}

/// `put(size)` writes the first `size` bytes of `bytes`.
template <typename Put>
ssize_t write_any(int descriptor, const void* bytes, size_t size, std::uint64_t offset,
                  const Put& put) {
  const Path path = path_of(descriptor);
  if (!concerns(path.text)) return put(size);
  const std::lock_guard lock(one_at_a_time);
  if (strikes("write")) {
    if (!plan().is_short && !plan().kills) {
      errno = plan().error;
      return -1;
    }
    size = (size + 1) / 2;
    const ssize_t written = put(size);
    if (plan().kills) die();
    log(LogOp::write, inode_of(descriptor), offset, nullptr, bytes, size);
    return written;
  }
  const ssize_t written = put(size);
  if (written > 0) {
    log(LogOp::write, inode_of(descriptor), offset, path.text, bytes,
        static_cast<std::uint64_t>(written));
  }
  return written;
}

int truncate_any(int descriptor, off_t size) {
  static const auto real = next<int(int, off_t)>("ftruncate");
  if (!concerns(path_of(descriptor).text)) return real(descriptor, size);
  const std::lock_guard lock(one_at_a_time);
  if (strikes("truncate")) {
    if (plan().kills) die();
    errno = plan().error;
    return -1;
  }
  const int result = real(descriptor, size);
  if (result == 0) {
    log(LogOp::truncate, inode_of(descriptor), static_cast<std::uint64_t>(size), nullptr, nullptr,
        0);
  }
  return result;
}

int sync_any(int descriptor, const char* name) {
  const auto real = next<int(int)>(name);
  const Path path = path_of(descriptor);
  if (!concerns(path.text)) return real(descriptor);
  const std::lock_guard lock(one_at_a_time);
  if (strikes("sync")) {
    if (plan().kills) die();
    errno = plan().error;
    return -1;
  }
  struct stat status {};
  fstat(descriptor, &status);
  const int result = real(descriptor);
  if (result == 0) {
    log(S_ISDIR(status.st_mode) ? LogOp::sync_folder : LogOp::sync, status.st_ino, 0, path.text,
        nullptr, 0);
  }
  return result;
}

int remove_any(const char* path, const char* name) {
  const auto real = next<int(const char*)>(name);
  const Path whole = absolute(path);
  if (!concerns(whole.text)) return real(path);
  const std::lock_guard lock(one_at_a_time);
  const int result = real(path);
  if (result == 0) log(LogOp::remove, 0, 0, whole.text, nullptr, 0);
  return result;
}

mode_t mode_of(int flags, va_list list) {
  return (flags & O_CREAT) != 0 ? va_arg(list, mode_t) : 0;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = mode_of(flags, list);
  va_end(list);
  return open_any(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = mode_of(flags, list);
  va_end(list);
  return open_any(path, flags, mode);
}

ssize_t write(int descriptor, const void* bytes, size_t size) {
  static const auto real = next<WriteCall>("write");
  const off_t at = lseek(descriptor, 0, SEEK_CUR);
  return write_any(descriptor, bytes, size, static_cast<std::uint64_t>(at < 0 ? 0 : at),
                   [&](size_t part) { return real(descriptor, bytes, part); });
}

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  static const auto real = next<PwriteCall>("pwrite");
  return write_any(descriptor, bytes, size, static_cast<std::uint64_t>(offset),
                   [&](size_t part) { return real(descriptor, bytes, part, offset); });
}

ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off_t offset) {
  return pwrite(descriptor, bytes, size, offset);
}

int ftruncate(int descriptor, off_t size) noexcept { return truncate_any(descriptor, size); }
int ftruncate64(int descriptor, off_t size) noexcept { return truncate_any(descriptor, size); }
int fsync(int descriptor) { return sync_any(descriptor, "fsync"); }
int fdatasync(int descriptor) { return sync_any(descriptor, "fdatasync"); }
int unlink(const char* path) noexcept { return remove_any(path, "unlink"); }
int remove(const char* path) noexcept { return remove_any(path, "remove"); }

int rename(const char* from, const char* to) noexcept {
  static const auto real = next<int(const char*, const char*)>("rename");
  const Path source = absolute(from), target = absolute(to);
  if (!concerns(target.text)) return real(from, to);
  const std::lock_guard lock(one_at_a_time);
  if (strikes("rename")) {
    if (plan().kills) die();
    errno = plan().error;
    return -1;
  }
  const int result = real(from, to);
  if (result == 0) log(LogOp::rename, 0, 0, source.text, target.text, strlen(target.text));
  return result;
}

}  // extern "C"
