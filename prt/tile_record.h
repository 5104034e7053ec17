// What is kept of a traced tile until the file is put together, and its bytes in journals and
// between processes.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "prt/tile_codec.h"
#include "prt/tolerance.h"
#include "prt/transport_writer.h"

namespace haarlight {

/// One tile in so many has its error measured.
inline constexpr int kMeasureEvery = 8;

struct TileRecord {
  CompressedTile tile;
  std::vector<Rgb> color;        ///< kTileRows
  std::vector<float> coverage;   ///< kTileRows
  PictureError error;            ///< of compression; empty for tiles that are not measured
  std::vector<double> pictures;  ///< of the exact rows (see tile_pictures), where measured: what
                                 ///< later losses are measured against
  PictureError noise;            ///< estimated; empty if nothing was left to chance
};

/// Compresses the rows of tile `tile`, and measures what that did to every kMeasureEvery-th.
TileRecord make_tile_record(const HaarLayout& layout, int tile, const TileRows& rows,
                            std::span<const float> thresholds);

/// A record as bytes, checksummed, with its tile's number.
std::vector<std::byte> pack_record(int tile, const TileRecord& record);

/// Bytes of the fixed part, and of the whole record it begins; nothing if it cannot be one of a
/// transport of `tiles` tiles with at most `left` bytes to come.
inline constexpr std::size_t kRecordHeaderBytes = 64;
std::optional<std::uint64_t> packed_record_size(std::span<const std::byte> header, int tiles,
                                                std::uint64_t left);

/// The tile a packed record is of. Requires kRecordHeaderBytes.
int packed_record_tile(std::span<const std::byte> bytes);

/// Whether the checksum is right. Requires a whole record.
bool packed_record_is_whole(std::span<const std::byte> bytes);

/// Nothing if the bytes are not those of one whole record.
std::optional<TileRecord> unpack_record(std::span<const std::byte> bytes);

}  // namespace haarlight
