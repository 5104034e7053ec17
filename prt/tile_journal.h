// The journal of a transport being written: a head and compressed tiles, appended as they come, so
// that a run that was cut off can go on and slices of a run can be joined. Private to prt/.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "prt/journal_head.h"
#include "prt/tile_record.h"

namespace haarlight {

class TileJournal {
 public:
  /// Opens or makes `file`. Its records are kept only if `resume` is set and it is of the same run
  /// and shard as `head`; a torn last record is cut off. Throws Error{io}.
  TileJournal(const std::filesystem::path& file, const JournalHead& head, bool resume);
  /// Opens a journal that is there, to be read only. Throws Error{missing}, Error{io}, or
  /// Error{format} if it is none or its head is damaged. Records after the first damaged one are
  /// not seen.
  explicit TileJournal(const std::filesystem::path& file);
  ~TileJournal();
  TileJournal(const TileJournal&) = delete;
  TileJournal& operator=(const TileJournal&) = delete;

  /// The head of a journal that is there and whole; nothing otherwise.
  static std::optional<JournalHead> peek(const std::filesystem::path& file);

  const JournalHead& head() const { return head_; }
  const std::filesystem::path& file() const { return file_; }
  bool has(int tile) const;
  int count() const;
  /// How many of the tiles `first`, first + step, ... there are.
  int count(int first, int step) const;
  /// Bytes of a tile's record; 0 if it was never written.
  std::uint64_t record_bytes(int tile) const;
  /// Appends a packed record (see pack_record), whole or not at all. Thread-safe. Throws Error{io},
  /// Error{format} for bytes that are no record of this transport.
  void append(std::span<const std::byte> record);
  /// Nothing for a tile that was never written. Thread-safe. Throws Error{format} if the record
  /// no longer reads as it was written.
  std::optional<TileRecord> read(int tile) const;
  void remove();  ///< closes and deletes the file

 private:
  struct Place {
    std::uint64_t offset = 0, size = 0;
  };
  void scan(std::uint64_t begin, std::uint64_t file_size);

  std::filesystem::path file_;
  JournalHead head_;
  int descriptor_ = -1;
  std::uint64_t end_ = 0;
  std::unordered_map<int, Place> places_;  // by tile: no larger than what the file holds
  mutable std::mutex mutex_;
};

}  // namespace haarlight
