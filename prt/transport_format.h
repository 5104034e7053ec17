// The bytes of a transport file; docs/transport_format.md explains them. Private to prt/.

#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace haarlight {

static_assert(std::endian::native == std::endian::little,
              "transport files are little-endian and are read without conversion");

inline constexpr char kTransportMagic[8] = {'H', 'a', 'a', 'r', 'l', 't', '\r', '\n'};
inline constexpr std::uint32_t kTransportVersion = 1;

/// A stretch of the file.
struct FileSection {
  std::uint64_t offset = 0, size = 0;
  std::uint64_t hash = 0;  ///< XXH3, 64 bits, of its bytes as stored
};

/// First bytes of the file. All fields are naturally aligned; reserved bytes are zero.
struct TransportHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t face_size;
  std::uint32_t width, height;
  std::uint32_t chunk_count;
  std::uint32_t reserved;
  std::uint64_t file_size;
  double camera_position[3];
  double camera_orientation[9];  ///< rows
  double camera_vertical_fov;
  FileSection meta;           ///< JSON text
  FileSection rows;           ///< zstd of the row tables: see RowTables in transport_tables.h
  FileSection column_norms;   ///< float, one a coefficient
  FileSection chunk_table;    ///< FileSection, one a chunk
  std::uint64_t header_hash;  ///< XXH3 of all bytes above
};
static_assert(sizeof(TransportHeader) == 8 + 24 + 8 + 13 * 8 + 4 * 24 + 8);

inline constexpr std::size_t kChunkAlignment = 4096;

}  // namespace haarlight
