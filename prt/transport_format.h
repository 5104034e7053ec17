// The bytes of a transport file; docs/transport_format.md explains them. Private to prt/.

#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace haarlight {

static_assert(std::endian::native == std::endian::little,
              "transport files are little-endian and are read without conversion");

inline constexpr char kTransportMagic[8] = {'H', 'a', 'a', 'r', 'l', 't', '\r', '\n'};
inline constexpr std::uint32_t kTransportVersion = 3;  ///< written; 1 and 2 are read too

/// A stretch of the file.
struct FileSection {
  std::uint64_t offset = 0, size = 0;
  std::uint64_t hash = 0;  ///< XXH3, 64 bits, of its bytes as stored
};

/// An entry in the table of sections that a file may have or not. A reader passes over names that
/// it does not know, their checksums checked, so that a new section needs no new version.
struct NamedSection {
  char name[8];  ///< filled up with zeros
  FileSection section;
};
static_assert(sizeof(NamedSection) == 32);
inline constexpr char kViewFactorsName[8] = {'v', 'i', 'e', 'w'};
inline constexpr char kClustersName[8] = {'c', 'l', 'u', 's', 't', 'e', 'r', 's'};
inline constexpr std::uint64_t kMostNamedSections = 64;

/// First bytes of the file. All fields are naturally aligned; reserved bytes are zero. Version 1
/// ends, with its hash, where `terms` stands in version 2, and has kind 0; version 2 ends where
/// `named` stands in version 3.
struct TransportHeader {
  char magic[8];
  std::uint32_t version;
  std::uint32_t face_size;
  std::uint32_t width, height;
  std::uint32_t chunk_count;
  std::uint32_t kind;  ///< TransportKind: 0 image, 1 mesh, 2 clusters
  std::uint64_t file_size;
  double camera_position[3];
  double camera_orientation[9];  ///< rows
  double camera_vertical_fov;
  FileSection meta;          ///< JSON text
  FileSection rows;          ///< zstd of the row tables: see RowTables in transport_tables.h
  FileSection column_norms;  ///< float, one a coefficient
  FileSection chunk_table;   ///< FileSection, one a chunk
  std::uint32_t terms;       ///< outputs a pixel or vertex
  std::uint32_t vertices, triangles;  ///< of a mesh, else 0
  std::uint32_t mesh_materials;       ///< 1: the mesh tells a material a vertex
  FileSection mesh;                   ///< zstd, see prt/transport_mesh.h; empty for a picture
  FileSection named;                  ///< NamedSection, each name once; may be empty
  std::uint64_t header_hash;          ///< XXH3 of all bytes above
};
inline constexpr std::size_t kTransportHeader1Hash = 8 + 24 + 8 + 13 * 8 + 4 * 24;
static_assert(offsetof(TransportHeader, terms) == kTransportHeader1Hash);
inline constexpr std::size_t kTransportHeader2Hash = kTransportHeader1Hash + 16 + 24;
static_assert(offsetof(TransportHeader, named) == kTransportHeader2Hash);
static_assert(sizeof(TransportHeader) == kTransportHeader2Hash + 24 + 8);

inline constexpr std::size_t kChunkAlignment = 4096;
inline constexpr int kMaxTerms = 256;                   ///< a vertex; a picture has one
inline constexpr std::size_t kMaxOutputs = 0x70000000;  ///< so that padded rows are an int

}  // namespace haarlight
