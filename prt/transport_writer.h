// Builds transport files tile by tile, in bounded memory, resumable, the final name appearing last.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
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

/// Output after output, padded to a whole chunk: for vectors of clusters.
std::vector<std::uint32_t> plain_row_order(std::size_t outputs);

/// image_row_order, mesh_row_order or plain_row_order, by the kind.
std::vector<std::uint32_t> row_order(const TransportInfo& info);

/// Tiles up to the last that has a row in use; what follows is padding.
int used_tiles(std::span<const std::uint32_t> order);

/// One tile of exact rows as precomputation makes them: Haar coefficients of
///   t[k] = integral over texel k of V f_r cos dw   (f_r without the row's colour if grey).
struct TileRows {
  unsigned rgb_blocks = 0;      ///< bit b: block b of the tile has three channels
  std::vector<float> values;    ///< [channel][row][coefficient]; 1 channel (kTileRows rows) when
                                ///< rgb_blocks == 0, else 3, grey blocks using channel 0 only
  std::vector<Rgb> color;       ///< kTileRows: albedo of grey rows; {1,1,1} for rows of RGB blocks
  std::vector<float> coverage;  ///< kTileRows: share of the pixel covered by the scene; 1: vertex
  /// How far chance may have moved the tile's picture, per built-in lighting: expected squared
  /// error and squared picture, summed over rows and channels. Empty: nothing was left to chance.
  std::vector<double> noise_variance{}, noise_energy{};
};

/// Finds how small an entry may be dropped, from a few pilot tiles, so that the relative error of
/// the picture (root mean square over all pilot rows and channels) stays below `error` under every
/// lighting of the built-in set: sun and sky, lamps in a dark room, windows, soft clouds.
/// Source: ours; the rule of thumb "uniform threshold on orthonormal coefficients, blocks of 16".
class ToleranceTuner {
 public:
  /// What one tile says of thresholds.
  struct Pilot {
    std::vector<double> error;   ///< [lighting][candidate]: squared error of the picture, colours
                                 ///< applied, if what is below the candidate were dropped and the
                                 ///< rest rounded
    std::vector<double> energy;  ///< [lighting]: the picture squared
    std::vector<double> scales;  ///< [candidate]: scales of blocks between it and the one before
  };

  ToleranceTuner(const HaarLayout& layout, double error);
  ~ToleranceTuner();
  Pilot measure(const TileRows& tile) const;  ///< the work; safe to call from many threads
  void add(Pilot pilot);                      ///< not thread-safe; order does not matter
  void add(const TileRows& tile) { add(measure(tile)); }
  /// Per band; all 0 when error == 0 or no light falls. The pilots are a sample of `tiles` tiles
  /// (0: of very many), of which others are measured in the end: thresholds are such that these
  /// stay below the error by two standard deviations of the difference. `of`: what as many pilots
  /// would have led to (0: those that there are).
  std::vector<float> thresholds(int tiles = 0, int of = 0) const;
  /// The same, but high enough for the mean of the tiles to have at most `tile_bytes` bytes in a
  /// file, as far as can be told before.
  std::vector<float> thresholds_for_size(double tile_bytes, int tiles = 0) const;
  /// Bytes of the mean tile in a file at a threshold, about.
  double tile_bytes(float threshold) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A slice of a run: tiles t with t % count == index - 1.
struct Shard {
  int index = 1, count = 1;
  bool has(int tile) const { return tile % count == index - 1; }
  bool operator==(const Shard&) const = default;
};

struct TransportWriterOptions {
  std::vector<float> thresholds;  ///< per band: blocks whose RMS entry is below are dropped
  std::string fingerprint;        ///< what the rows are made from (scene, camera, options): a
                                  ///< journal of another fingerprint is not continued
  bool resume = false;            ///< continue the journal if it is there and fits
  std::string meta{};             ///< as for finish(); what a shard carries until it is joined
  Shard shard{};                  ///< of which the journal is; all tiles may still be written
  std::uint64_t max_bytes = 0;    ///< that the file may have; 0: no limit. Further blocks are
                                  ///< dropped, the weakest first, as far as it takes
};

/// Where tiles go until the file is put together: FILE.partial, or FILE.shard-1-of-3.
std::filesystem::path journal_path(const std::filesystem::path& file, const Shard& shard);

/// The thresholds of a journal that --resume would go on with, so that they need not be found
/// again; nothing if there is none of this fingerprint.
std::optional<std::vector<float>> journal_thresholds(const std::filesystem::path& file,
                                                     const std::string& fingerprint,
                                                     const Shard& shard);

/// Largest number of bytes that a file has beside the columns' entries.
std::uint64_t transport_overhead_bytes(const TransportInfo& info);

/// Throws Error{invalid_argument} naming the size needed if tables and indices alone are larger.
void check_max_bytes(const TransportInfo& info, std::uint64_t max_bytes);

struct TileRecord;  // prt/tile_record.h

struct FinishOptions {
  Progress progress{};
  int workers = 0;  ///< chunks put together at a time, each in some hundred MB; 0: all threads
  /// What to show for tiles that were never written: a preview. Called from several threads; may
  /// return null. With it the journal stays unless all tiles were there.
  std::function<std::shared_ptr<const TileRecord>(int tile)> stand_in{};
  /// Of kind clusters: the weights, where they are found only along with the last tile. Starts of
  /// clusters and vectors are as in the info that the writer was made with.
  std::shared_ptr<const ClusterWeights> clusters{};
  /// What the file says as measured_error and column norms, where rows alone do not tell them.
  std::optional<double> measured_error{};
  std::vector<float> column_norms{};
};

/// What a finished file is.
struct TransportSummary {
  std::uint64_t bytes = 0;
  double measured_error = 0;  ///< largest relative picture error over the built-in lightings
  double noise = 0;           ///< relative noise of the picture, estimated; 0: none
  float size_threshold = 0;   ///< blocks below it were dropped for the sake of max_bytes; 0: none
  bool complete = false;      ///< all tiles were written
};

/// Writes one transport file. Tiles may come in any order and from several threads; the file is
/// the same bytes whatever the order. Compressed tiles are appended to a journal (journal_path) as
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
  std::uint64_t record_bytes(int tile) const;       ///< that it has there; 0: it is not
  void write_tile(int tile, const TileRows& rows);  ///< thread-safe; compresses outside the lock
  /// The same for a tile that was compressed elsewhere: see pack_record in prt/tile_record.h.
  void write_record(std::span<const std::byte> packed);
  void keep();  ///< leaves the journal, even without tiles: the thresholds in it are worth keeping

  /// Assembles, checksums and renames. Tiles never written are empty. `meta` is the JSON object
  /// kept with the file; keys "measured_error" (largest relative picture error over the built-in
  /// lightings, from every 8th tile, compressed against exact), "thresholds", "bytes", "complete"
  /// are added, and where they say something "tiles", "tiles_traced", "noise", "max_bytes". Throws
  /// Error{cancelled} if `progress` says so.
  TransportSummary finish(const std::string& meta, const FinishOptions& options = {});

  /// Removes the journal; for a caller that gave up for good.
  void discard();

  /// A file of nothing but stand-ins, for a run that ended before its first tile: no journal is
  /// made or touched. Takes what the constructor and finish() take; the thresholds are the
  /// caller's guess.
  static TransportSummary write_stand_ins(const std::filesystem::path& file, TransportInfo info,
                                          const TransportWriterOptions& options,
                                          const FinishOptions& finishing);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A transport in memory from all its tiles; for tests and small uses of the library.
/// `tiles.size()` is row_order(info).size() / kTileRows; a tile without values is empty.
Transport build_transport(TransportInfo info, std::span<const TileRows> tiles,
                          const std::vector<float>& thresholds);

}  // namespace haarlight
