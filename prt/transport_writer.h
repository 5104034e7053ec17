// Builds transport files tile by tile, in bounded memory, resumable, the final name appearing last.

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "prt/transport.h"

namespace haarlight {

/// Which output each stored row of a width x height picture belongs to: 8x8 pixel tiles along a
/// space-filling curve, four 4x4 blocks a tile, padding (kNoOutput) where the picture ends and up
/// to a whole chunk. Its size is a multiple of kChunkRows.
std::vector<std::uint32_t> image_row_order(int width, int height);

/// The same for a mesh of `terms` outputs a vertex: blocks of 16 vertices that lie near each other
/// and face the same way, so that they see nearly the same light, one block a term, one group of
/// vertices after the other. Cut in halves along the longest extent of positions and normals
/// together, again and again; ties go by vertex number.
std::vector<std::uint32_t> mesh_row_order(const TransportMesh& mesh, int terms = 1);

/// image_row_order or mesh_row_order, by the kind.
std::vector<std::uint32_t> row_order(const TransportInfo& info);

/// One tile of exact rows as precomputation makes them: Haar coefficients of
///   t[k] = integral over texel k of V f_r cos dw   (f_r without the row's colour if grey).
struct TileRows {
  unsigned rgb_blocks = 0;      ///< bit b: block b of the tile has three channels
  std::vector<float> values;    ///< [channel][row][coefficient]; 1 channel (kTileRows rows) when
                                ///< rgb_blocks == 0, else 3, grey blocks using channel 0 only
  std::vector<Rgb> color;       ///< kTileRows: albedo of grey rows; {1,1,1} for rows of RGB blocks
  std::vector<float> coverage;  ///< kTileRows: share of the pixel covered by the scene; 1: vertex
};

/// Finds how small an entry may be dropped, from a few pilot tiles, so that the relative error of
/// the picture (root mean square over all pilot rows and channels) stays below `error` under every
/// lighting of the built-in set: sun and sky, lamps in a dark room, windows, soft clouds.
/// Source: ours; the rule of thumb "uniform threshold on orthonormal coefficients, blocks of 16".
class ToleranceTuner {
 public:
  ToleranceTuner(const HaarLayout& layout, double error);
  ~ToleranceTuner();
  void add(const TileRows& tile);         ///< not thread-safe
  std::vector<float> thresholds() const;  ///< per band; all 0 when error == 0 or no light falls
 private:
  struct State;
  std::unique_ptr<State> state_;
};

struct TransportWriterOptions {
  std::vector<float> thresholds;  ///< per band: blocks whose RMS entry is below are dropped
  std::string fingerprint;        ///< what the rows are made from (scene, camera, options): a
                                  ///< journal of another fingerprint is not continued
  bool resume = false;            ///< continue FILE.partial if it is there and fits
};

/// Writes one transport file. Tiles may come in any order and from several threads; the file is
/// the same bytes whatever the order. Compressed tiles are appended to a journal, FILE.partial, as
/// they come, so that a run that was cut off goes on where it was; finish() sorts them into chunks.
/// Throws Error{io} naming the file on any refusal of the system.
class TransportWriter {
 public:
  TransportWriter(const std::filesystem::path& file, TransportInfo info,
                  TransportWriterOptions options);
  /// Leaves the journal when finish() was not reached and at least one tile is in it.
  ~TransportWriter();

  int tile_count() const;
  /// The outputs of a tile's rows: kTileRows entries of row_order.
  std::span<const std::uint32_t> tile_outputs(int tile) const;
  bool has_tile(int tile) const;                    ///< already in the journal
  void write_tile(int tile, const TileRows& rows);  ///< thread-safe; compresses outside the lock

  /// Assembles, checksums and renames. Tiles never written are empty. `meta` is the JSON object
  /// kept with the file; keys "measured_error" (largest relative picture error over the built-in
  /// lightings, from every 8th tile, compressed against exact), "thresholds", "bytes" are added.
  void finish(const std::string& meta, const Progress& progress = {});

  /// Removes the journal; for a caller that gave up for good.
  void discard();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A transport in memory from all its tiles; for tests and small uses of the library.
/// `tiles.size()` is row_order(info).size() / kTileRows; a tile without values is empty.
Transport build_transport(TransportInfo info, std::span<const TileRows> tiles,
                          const std::vector<float>& thresholds);

}  // namespace haarlight
