// Append-only journal of compressed tiles.

#include "prt/tile_journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "core/error.h"

namespace haarlight {
namespace {

constexpr char kJournalMagic[8] = {'H', 'l', 't', 'j', 'r', 'n', '0', '1'};

struct JournalHeader {
  char magic[8];
  std::uint64_t fingerprint;
  std::uint64_t tiles;
};

struct RecordHeader {
  std::uint32_t tile;
  std::uint32_t rgb_blocks;
  std::uint64_t present, scales, values, errors;  ///< counts of what follows
  std::uint64_t hash;                             ///< of the payload
};

[[noreturn]] void refuse(const std::filesystem::path& file, const char* what) {
  throw Error(ErrorKind::io, fmt::format("{}: {}: {}", file.string(), what, std::strerror(errno)));
}

void write_all(int descriptor, const std::byte* bytes, std::size_t size, std::uint64_t offset,
               const std::filesystem::path& file) {
  while (size > 0) {
    const ssize_t n = ::pwrite(descriptor, bytes, size, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      if (n == 0) errno = ENOSPC;
      refuse(file, "cannot write");
    }
    bytes += n;
    size -= static_cast<std::size_t>(n);
    offset += static_cast<std::uint64_t>(n);
  }
}

// False at the end of the file.
bool read_all(int descriptor, std::byte* bytes, std::size_t size, std::uint64_t offset,
              const std::filesystem::path& file) {
  while (size > 0) {
    const ssize_t n = ::pread(descriptor, bytes, size, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) refuse(file, "cannot read");
    if (n == 0) return false;
    bytes += n;
    size -= static_cast<std::size_t>(n);
    offset += static_cast<std::uint64_t>(n);
  }
  return true;
}

constexpr std::uint64_t kRowBytes = kTileRows * (sizeof(Rgb) + sizeof(float));

std::uint64_t payload_size(const RecordHeader& h) {
  return h.present + 2 * h.scales + h.values + 16 * h.errors + kRowBytes;
}

template <typename T>
void append_bytes(std::vector<std::byte>& to, const std::vector<T>& values) {
  const std::size_t begin = to.size(), size = values.size() * sizeof(T);
  to.resize(begin + size);
  if (size > 0) std::memcpy(to.data() + begin, values.data(), size);
}

template <typename T>
const std::byte* take(const std::byte* from, std::vector<T>& values, std::uint64_t count) {
  values.resize(count);
  if (count > 0) std::memcpy(static_cast<void*>(values.data()), from, count * sizeof(T));
  return from + count * sizeof(T);
}

}  // namespace

TileJournal::TileJournal(const std::filesystem::path& file, const std::string& fingerprint,
                         int tiles, bool resume)
    : file_(file), places_(static_cast<std::size_t>(tiles)) {
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0) refuse(file, "cannot be created");
  JournalHeader header{};
  std::memcpy(header.magic, kJournalMagic, sizeof kJournalMagic);
  header.fingerprint = XXH3_64bits(fingerprint.data(), fingerprint.size());
  header.tiles = static_cast<std::uint64_t>(tiles);

  try {
    JournalHeader found{};
    const bool ours =
        resume &&
        read_all(descriptor_, reinterpret_cast<std::byte*>(&found), sizeof found, 0, file_) &&
        std::memcmp(&found, &header, sizeof header) == 0;
    if (ours) {
      scan();
    } else {
      if (::ftruncate(descriptor_, 0) != 0) refuse(file_, "cannot be emptied");
      write_all(descriptor_, reinterpret_cast<const std::byte*>(&header), sizeof header, 0, file_);
      end_ = sizeof header;
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

TileJournal::~TileJournal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

// Finds whole records; the first that is torn or damaged ends the journal.
void TileJournal::scan() {
  end_ = sizeof(JournalHeader);
  const off_t file_end = ::lseek(descriptor_, 0, SEEK_END);
  if (file_end < 0) refuse(file_, "cannot read");
  const auto file_size = static_cast<std::uint64_t>(file_end);
  std::vector<std::byte> payload;
  for (;;) {
    RecordHeader header;
    if (!read_all(descriptor_, reinterpret_cast<std::byte*>(&header), sizeof header, end_, file_)) {
      break;
    }
    const std::uint64_t left = file_size - std::min(file_size, end_ + sizeof header);
    if (header.tile >= places_.size() || header.present > left || header.scales > left ||
        header.values > left || header.errors > left || payload_size(header) > left) {
      break;
    }
    payload.resize(payload_size(header));
    if (!read_all(descriptor_, payload.data(), payload.size(), end_ + sizeof header, file_) ||
        XXH3_64bits(payload.data(), payload.size()) != header.hash) {
      break;
    }
    places_[header.tile] = {end_, sizeof header + payload.size()};
    end_ += sizeof header + payload.size();
  }
  if (::ftruncate(descriptor_, static_cast<off_t>(end_)) != 0) refuse(file_, "cannot be cut");
}

bool TileJournal::has(int tile) const {
  const std::lock_guard lock(mutex_);
  return places_[static_cast<std::size_t>(tile)].size > 0;
}

int TileJournal::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(
      std::count_if(places_.begin(), places_.end(), [](const Place& p) { return p.size > 0; }));
}

void TileJournal::append(int tile, const TileRecord& record) {
  RecordHeader header{};
  header.tile = static_cast<std::uint32_t>(tile);
  header.rgb_blocks = record.tile.rgb_blocks;
  header.present = record.tile.present.size();
  header.scales = record.tile.scales.size();
  header.values = record.tile.values.size();
  header.errors = record.error.error.size();
  std::vector<std::byte> bytes(sizeof header);
  bytes.reserve(sizeof header + payload_size(header));
  append_bytes(bytes, record.tile.present);
  append_bytes(bytes, record.tile.scales);
  append_bytes(bytes, record.tile.values);
  append_bytes(bytes, record.error.error);
  append_bytes(bytes, record.error.energy);
  append_bytes(bytes, record.color);
  append_bytes(bytes, record.coverage);
  header.hash = XXH3_64bits(bytes.data() + sizeof header, bytes.size() - sizeof header);
  std::memcpy(bytes.data(), &header, sizeof header);

  const std::lock_guard lock(mutex_);
  write_all(descriptor_, bytes.data(), bytes.size(), end_, file_);
  places_[static_cast<std::size_t>(tile)] = {end_, bytes.size()};
  end_ += bytes.size();
}

std::optional<TileRecord> TileJournal::read(int tile) const {
  Place place;
  {
    const std::lock_guard lock(mutex_);
    place = places_[static_cast<std::size_t>(tile)];
  }
  if (place.size == 0) return std::nullopt;
  std::vector<std::byte> bytes(place.size);
  RecordHeader header;
  const bool whole = read_all(descriptor_, bytes.data(), bytes.size(), place.offset, file_);
  if (whole) std::memcpy(&header, bytes.data(), sizeof header);
  if (!whole || sizeof header + payload_size(header) != bytes.size() ||
      XXH3_64bits(bytes.data() + sizeof header, bytes.size() - sizeof header) != header.hash) {
    throw Error(ErrorKind::format,
                fmt::format("{}: tile {} does not read as it was written", file_.string(), tile));
  }
  TileRecord record;
  record.tile.rgb_blocks = header.rgb_blocks;
  const std::byte* from = bytes.data() + sizeof header;
  from = take(from, record.tile.present, header.present);
  from = take(from, record.tile.scales, header.scales);
  from = take(from, record.tile.values, header.values);
  from = take(from, record.error.error, header.errors);
  from = take(from, record.error.energy, header.errors);
  from = take(from, record.color, kTileRows);
  take(from, record.coverage, kTileRows);
  return record;
}

void TileJournal::remove() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

}  // namespace haarlight
