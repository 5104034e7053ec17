// Append-only journal of compressed tiles.

#include "prt/tile_journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "core/error.h"

namespace haarlight {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const char* what) {
  throw Error(ErrorKind::io, fmt::format("{}: {}: {}", file.string(), what, std::strerror(errno)));
}

void write_all(int descriptor, std::span<const std::byte> bytes, std::uint64_t offset,
               const std::filesystem::path& file) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      if (n == 0) errno = ENOSPC;
      refuse(file, "cannot write");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
}

// False at the end of the file.
bool read_all(int descriptor, std::span<std::byte> bytes, std::uint64_t offset,
              const std::filesystem::path& file) {
  while (!bytes.empty()) {
    const ssize_t n = ::pread(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) refuse(file, "cannot read");
    if (n == 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
  return true;
}

std::uint64_t size_of(int descriptor, const std::filesystem::path& file) {
  const off_t end = ::lseek(descriptor, 0, SEEK_END);
  if (end < 0) refuse(file, "cannot read");
  return static_cast<std::uint64_t>(end);
}

// The bytes of the head at the beginning of a file; empty if there is no room for what it claims.
std::vector<std::byte> read_head(int descriptor, std::uint64_t file_size,
                                 const std::filesystem::path& file) {
  std::vector<std::byte> bytes(kHeadFixedBytes);
  if (file_size < bytes.size() || !read_all(descriptor, bytes, 0, file)) return {};
  const std::uint64_t size = packed_head_size(bytes);
  if (size == 0 || size > file_size) return {};
  bytes.resize(size);
  return read_all(descriptor, bytes, 0, file) ? bytes : std::vector<std::byte>();
}

}  // namespace

TileJournal::TileJournal(const std::filesystem::path& file, const JournalHead& head, bool resume)
    : file_(file), head_(head) {
  const std::optional<JournalHead> found = resume ? peek(file) : std::nullopt;
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) refuse(file, "cannot be created");
  try {
    if (found && same_run(*found, head) && found->shard == head.shard) {
      const std::uint64_t file_size = size_of(descriptor_, file_);
      scan(read_head(descriptor_, file_size, file_).size(), file_size);
      if (::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) refuse(file_, "cannot be cut");
    } else {
      if (::ftruncate(descriptor_, 0) != 0) refuse(file_, "cannot be emptied");
      const std::vector<std::byte> bytes = pack_head(head);
      write_all(descriptor_, bytes, 0, file_);
      end_ = bytes.size();
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

TileJournal::TileJournal(const std::filesystem::path& file) : file_(file) {
  descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0 && errno == ENOENT) {
    throw Error(ErrorKind::missing, fmt::format("{}: no such file, expected a shard made with "
                                                "haarlight precompute --shard",
                                                file.string()));
  }
  if (descriptor_ < 0) refuse(file, "cannot be opened");
  try {
    const std::uint64_t file_size = size_of(descriptor_, file_);
    const std::vector<std::byte> bytes = read_head(descriptor_, file_size, file_);
    head_ = unpack_head(bytes, file.string());
    if (head_.tiles < 0 || head_.tiles > (1 << 25)) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: {} tiles, expected at most 2^25", file.string(), head_.tiles));
    }
    scan(bytes.size(), file_size);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

TileJournal::~TileJournal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::optional<JournalHead> TileJournal::peek(const std::filesystem::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return std::nullopt;
  std::optional<JournalHead> head;
  try {
    head = unpack_head(read_head(descriptor, size_of(descriptor, file), file), file.string());
  } catch (const Error&) {
    head.reset();  // not one of ours, or damaged: as if it were not there
  }
  ::close(descriptor);
  return head;
}

// Finds whole records; the first that is torn or damaged ends the journal.
void TileJournal::scan(std::uint64_t begin, std::uint64_t file_size) {
  end_ = begin;
  std::vector<std::byte> bytes;
  while (end_ + kRecordHeaderBytes <= file_size) {
    bytes.resize(kRecordHeaderBytes);
    if (!read_all(descriptor_, bytes, end_, file_)) break;
    const std::optional<std::uint64_t> size =
        packed_record_size(bytes, head_.tiles, file_size - end_ - kRecordHeaderBytes);
    if (!size) break;
    bytes.resize(*size);
    if (!read_all(descriptor_, bytes, end_, file_) || !packed_record_is_whole(bytes)) break;
    places_[packed_record_tile(bytes)] = {end_, *size};
    end_ += *size;
  }
}

bool TileJournal::has(int tile) const { return record_bytes(tile) > 0; }

std::uint64_t TileJournal::record_bytes(int tile) const {
  const std::lock_guard lock(mutex_);
  const auto found = places_.find(tile);
  return found == places_.end() ? 0 : found->second.size;
}

int TileJournal::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(places_.size());
}

int TileJournal::count(int first, int step) const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::count_if(places_.begin(), places_.end(), [&](const auto& place) {
    return place.first >= first && (place.first - first) % step == 0;
  }));
}

void TileJournal::append(std::span<const std::byte> record) {
  const std::uint64_t left =
      record.size() < kRecordHeaderBytes ? 0 : record.size() - kRecordHeaderBytes;
  if (packed_record_size(record, head_.tiles, left) != record.size() ||
      !packed_record_is_whole(record)) {
    throw Error(ErrorKind::format,
                fmt::format("{}: was handed {} bytes that are no tile, expected a whole one",
                            file_.string(), record.size()));
  }
  const int tile = packed_record_tile(record);
  const std::lock_guard lock(mutex_);
  write_all(descriptor_, record, end_, file_);
  places_[tile] = {end_, record.size()};
  end_ += record.size();
}

std::optional<TileRecord> TileJournal::read(int tile) const {
  Place place;
  {
    const std::lock_guard lock(mutex_);
    const auto found = places_.find(tile);
    if (found != places_.end()) place = found->second;
  }
  if (place.size == 0) return std::nullopt;
  std::vector<std::byte> bytes(place.size);
  std::optional<TileRecord> record;
  if (read_all(descriptor_, bytes, place.offset, file_)) record = unpack_record(bytes);
  if (!record) {
    throw Error(ErrorKind::format,
                fmt::format("{}: tile {} does not read as it was written", file_.string(), tile));
  }
  return record;
}

void TileJournal::remove() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace haarlight
