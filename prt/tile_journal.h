// The journal of a transport being written: compressed tiles, appended as they come, so that a run
// that was cut off can go on. Private to prt/.

#pragma once

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "prt/tile_codec.h"
#include "prt/tolerance.h"
#include "prt/transport_writer.h"

namespace haarlight {

/// What is kept of a tile.
struct TileRecord {
  CompressedTile tile;
  std::vector<Rgb> color;       ///< kTileRows
  std::vector<float> coverage;  ///< kTileRows
  PictureError error;           ///< empty for tiles that were not measured
};

class TileJournal {
 public:
  /// Opens or makes `file`. Records are kept only if the journal carries `fingerprint` and
  /// `resume` is set; a torn last record is cut off. Throws Error{io}.
  TileJournal(const std::filesystem::path& file, const std::string& fingerprint, int tiles,
              bool resume);
  ~TileJournal();
  TileJournal(const TileJournal&) = delete;
  TileJournal& operator=(const TileJournal&) = delete;

  bool has(int tile) const;
  int count() const;
  void append(int tile, const TileRecord& record);  ///< thread-safe
  /// Nothing for a tile that was never written. Thread-safe. Throws Error{format} if the record
  /// no longer reads as it was written.
  std::optional<TileRecord> read(int tile) const;
  void remove();  ///< closes and deletes the file

 private:
  struct Place {
    std::uint64_t offset = 0, size = 0;
  };
  void scan();

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t end_ = 0;
  std::vector<Place> places_;
  mutable std::mutex mutex_;
};

}  // namespace haarlight
