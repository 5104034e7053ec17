// Precomputed light transport T: rows x coefficients, block-sparse and 8-bit, read-only.
// docs/transport_format.md gives the bytes; prt/transport_writer.h makes it; prt/row_sums.h uses
// it.

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/rgb.h"
#include "prt/cluster_weights.h"
#include "prt/transport_mesh.h"
#include "prt/view_factors.h"
#include "wavelet/haar.h"

namespace haarlight {

/// Rows are stored in blocks of 16, 4 blocks a tile, 64 tiles a chunk. For a picture a block is 4x4
/// pixels and a tile 8x8, so that rows of a block see nearly the same light; a chunk is 64 nearby
/// tiles. Inside a chunk the order is column by column, so that one wavelet's entries are one
/// stream of at most a few KiB.
inline constexpr int kBlockRows = 16;
inline constexpr int kTileBlocks = 4;
inline constexpr int kTileRows = kBlockRows * kTileBlocks;
inline constexpr int kChunkTiles = 64;
inline constexpr int kChunkBlocks = kChunkTiles * kTileBlocks;
inline constexpr int kChunkRows = kChunkTiles * kTileRows;
inline constexpr std::uint32_t kNoOutput = 0xffffffffu;

/// What the rows of a transport are.
enum class TransportKind {
  image,    ///< pixels of one view
  mesh,     ///< vertices, to be looked at from anywhere
  clusters  ///< vectors that vertices are put together from (clustered PCA)
};

/// What a transport is of; kept in its file.
struct TransportInfo {
  TransportKind kind = TransportKind::image;
  int face_size = 64;
  int width = 0, height = 0;  ///< picture size; of a mesh, the size to draw it at unless told
  int terms = 1;  ///< outputs a pixel or vertex, >= 1; above 1 each belongs to a term of
                  ///< a factored BRDF
  Camera camera;  ///< the view (of a mesh: the first one)
  std::shared_ptr<const TransportMesh> mesh;       ///< null for kind image, else there
  std::shared_ptr<const ViewFactors> view;         ///< of `terms` terms; null: seen alike from
                                                   ///< everywhere, and terms is 1
  std::shared_ptr<const ClusterWeights> clusters;  ///< of kind clusters, else null
  std::string meta;  ///< JSON object: how it was made, its options, measured error

  /// Rows with a meaning: pixels, vertices or vectors of clusters, times terms. Output
  /// `i * terms + k` is term k of pixel y * width + x = i or of vertex i; of clusters see
  /// ClusterWeights.
  std::size_t output_count() const {
    const std::size_t places =
        clusters ? std::size_t{clusters->vectors()}
        : mesh   ? mesh->position.size()
                 : static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    return places * static_cast<std::size_t>(terms);
  }
};

/// One column's non-zero blocks inside a chunk.
/// A block whose rows share their colour (grey) has one scale and 16 values; the others (see
/// Transport::rgb_blocks) three scales and 3 x 16 values, channel after channel.
/// Entry = value * scale, the scale being the upper half of a float.
struct ColumnBlocks {
  const std::uint64_t* present = nullptr;  ///< 4 words: bit b says block b is stored; null: none
  const std::uint16_t* scales = nullptr;
  const std::int8_t* values = nullptr;
  std::uint32_t bytes = 0;  ///< of all three together, from `present` on
};

/// T itself. Immutable, safe to read from any number of threads; copies share the data.
class Transport {
 public:
  /// Reads a file into memory and checks every byte of it: sizes before anything is allocated,
  /// checksums, and that each column's blocks lie inside their chunk. What becomes of the file
  /// afterwards does not matter. Throws Error{missing} if there is no such
  /// file, Error{format} if it is not one of ours, is cut short, damaged or of a newer version
  /// (the message says which), Error{io} if the system refuses.
  static Transport open(const std::filesystem::path& file);

  const HaarLayout& layout() const;
  const TransportInfo& info() const;
  TransportKind kind() const { return info().kind; }
  int width() const { return info().width; }
  int height() const { return info().height; }
  /// Rows as stored, padding included: chunk_count() * kChunkRows.
  int rows() const;
  int chunk_count() const;

  /// Bytes of the chunks alone (what a frame streams from) and of the whole file.
  std::uint64_t chunk_bytes() const;
  std::uint64_t file_bytes() const;

  /// Per stored row: the output it belongs to (see TransportInfo::output_count), or kNoOutput for
  /// padding.
  std::span<const std::uint32_t> row_output() const;
  /// Per stored row: the colour its sum is multiplied with: the albedo of a grey row, 1 for an RGB
  /// row.
  std::span<const Rgb> row_color() const;
  /// Per output: share of the pixel covered by the scene, [0, 1]; the rest shows the environment. 1
  /// for vertices.
  std::span<const float> coverage() const;
  /// Per coefficient: L2 norm over all rows and channels of colour * T[:, j]. The picture's squared
  /// change when coefficient j alone changes by 1 in every channel; the weights of
  /// "transport-weighted" selection.
  std::span<const float> column_norms() const;

  /// Which blocks of a chunk are RGB: 4 words, the same for all columns.
  const std::uint64_t* rgb_blocks(int chunk) const;
  /// Column `index` inside `chunk`. Requires both in range.
  ColumnBlocks column(int chunk, int index) const;
  /// Stored bytes of column `index` over all chunks.
  std::uint64_t column_bytes(int index) const;

  struct Data;
  explicit Transport(std::shared_ptr<const Data> data);

 private:
  std::shared_ptr<const Data> data_;
};

}  // namespace haarlight
