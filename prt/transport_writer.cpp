// Writes transports tile by tile, and puts small ones together in memory.

#include "prt/transport_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/chunk.h"
#include "prt/row_tables.h"
#include "prt/tile_journal.h"
#include "prt/transport_assembly.h"
#include "prt/transport_data.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kTiles = static_cast<std::size_t>(kChunkTiles);

JournalHead head_of(const TransportInfo& info, const TransportWriterOptions& options, int tiles) {
  JournalHead head;
  head.info = info;
  head.info.meta.clear();
  head.fingerprint = options.fingerprint;
  head.thresholds = options.thresholds;
  head.meta = options.meta;
  head.max_bytes = options.max_bytes;
  head.shard = options.shard;
  head.tiles = tiles;
  return head;
}

void check_shard(const Shard& shard) {
  if (shard.index < 1 || shard.index > shard.count) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("shard {} of {}, expected 1 of 1 or more up to n of n", shard.index,
                            shard.count));
  }
}

}  // namespace

std::filesystem::path journal_path(const std::filesystem::path& file, const Shard& shard) {
  std::filesystem::path path = file;
  path += shard.count == 1 ? std::string(".partial")
                           : fmt::format(".shard-{}-of-{}", shard.index, shard.count);
  return path;
}

std::optional<std::vector<float>> journal_thresholds(const std::filesystem::path& file,
                                                     const std::string& fingerprint,
                                                     const Shard& shard) {
  const std::optional<JournalHead> head = TileJournal::peek(journal_path(file, shard));
  if (!head || head->fingerprint != fingerprint || !(head->shard == shard)) return std::nullopt;
  return head->thresholds;
}

void check_max_bytes(const TransportInfo& info, std::uint64_t max_bytes) {
  check_info(info);
  if (max_bytes == 0) return;
  const std::uint64_t least = transport_overhead_bytes(info);
  if (max_bytes < least) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("the file may have {} bytes, expected at least {}: so many tables and "
                            "indices has a transport of this size and lighting resolution",
                            max_bytes, least));
  }
}

struct TransportWriter::State {
  std::filesystem::path file;
  TransportInfo info;
  TransportWriterOptions options;
  HaarLayout layout;
  std::vector<std::uint32_t> row_order;
  int tiles = 0;
  std::optional<TileJournal> journal;
  bool keep = false;  // the journal, even if it is empty

  State(std::filesystem::path f, TransportInfo i, TransportWriterOptions o)
      : file(std::move(f)), info(std::move(i)), options(std::move(o)), layout(info.face_size) {}
};

TransportWriter::TransportWriter(const std::filesystem::path& file, TransportInfo info,
                                 TransportWriterOptions options) {
  check_info(info);
  check_shard(options.shard);
  check_max_bytes(info, options.max_bytes);
  state_ = std::make_unique<State>(file, std::move(info), std::move(options));
  State& s = *state_;
  if (s.options.thresholds.size() != static_cast<std::size_t>(s.layout.band_count())) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} thresholds, expected {}, one a band", s.options.thresholds.size(),
                            s.layout.band_count()));
  }
  s.row_order = row_order(s.info);
  s.tiles = used_tiles(s.row_order);
  s.keep = s.options.shard.count > 1;
  s.journal.emplace(journal_path(file, s.options.shard), head_of(s.info, s.options, s.tiles),
                    s.options.resume);
}

TransportWriter::~TransportWriter() {
  if (state_ && !state_->keep && state_->journal && state_->journal->count() == 0) {
    state_->journal->remove();
  }
}

int TransportWriter::tile_count() const { return state_->tiles; }

std::span<const std::uint32_t> TransportWriter::tile_outputs(int tile) const {
  return std::span(state_->row_order).subspan(static_cast<std::size_t>(tile) * kRows, kRows);
}

bool TransportWriter::has_tile(int tile) const { return state_->journal->has(tile); }
std::uint64_t TransportWriter::record_bytes(int tile) const {
  return state_->journal->record_bytes(tile);
}

void TransportWriter::write_tile(int tile, const TileRows& rows) {
  write_record(
      pack_record(tile, make_tile_record(state_->layout, tile, rows, state_->options.thresholds)));
}

void TransportWriter::write_record(std::span<const std::byte> packed) {
  state_->journal->append(packed);
}

void TransportWriter::keep() { state_->keep = true; }

void TransportWriter::discard() {
  state_->journal->remove();
  state_->keep = true;
}

TransportSummary TransportWriter::finish(const std::string& meta, const FinishOptions& options) {
  State& s = *state_;
  if (s.options.shard.count > 1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: a shard alone makes no file, expected all of them joined",
                            s.journal->file().string()));
  }
  JournalHead head = s.journal->head();
  if (options.clusters) {
    head.info.clusters = options.clusters;
    check_info(head.info);
    if (head.info.clusters->first_vector != s.info.clusters->first_vector ||
        head.info.clusters->first_vertex != s.info.clusters->first_vertex) {
      throw Error(ErrorKind::invalid_argument, "the weights are of other clusters than the rows");
    }
  }
  AssemblyInput input{head,
                      meta,
                      {},
                      s.journal->count(),
                      options.workers,
                      options.measured_error,
                      options.column_norms};
  if (input.workers < 1) input.workers = thread_count();
  input.record = [&](int tile) -> std::shared_ptr<const TileRecord> {
    if (std::optional<TileRecord> record = s.journal->read(tile)) {
      return std::make_shared<const TileRecord>(std::move(*record));
    }
    return options.stand_in ? options.stand_in(tile) : nullptr;
  };
  const TransportSummary summary = assemble_transport(s.file, input, options.progress);
  s.keep = true;
  if (summary.complete || !options.stand_in) s.journal->remove();
  return summary;
}

TransportSummary TransportWriter::write_stand_ins(const std::filesystem::path& file,
                                                  TransportInfo info,
                                                  const TransportWriterOptions& options,
                                                  const FinishOptions& finishing) {
  check_info(info);
  const JournalHead head = head_of(info, options, used_tiles(row_order(info)));
  AssemblyInput input{head, options.meta, finishing.stand_in, 0, finishing.workers};
  if (input.workers < 1) input.workers = thread_count();
  return assemble_transport(file, input, finishing.progress);
}

Transport build_transport(TransportInfo info, std::span<const TileRows> tiles,
                          const std::vector<float>& thresholds) {
  check_info(info);
  auto data = std::make_shared<Transport::Data>(info.face_size);
  const HaarLayout& layout = data->layout;
  RowTables tables = empty_tables(info);
  const std::size_t chunks = tables.row_output.size() / kChunkRows;
  if (tiles.size() != chunks * kTiles) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} tiles, expected {} for {} outputs", tiles.size(), chunks * kTiles,
                            info.output_count()));
  }
  auto buffers = std::make_shared<std::vector<std::vector<std::byte>>>(chunks);
  std::vector<std::vector<double>> energies(chunks);
  for (std::size_t c = 0; c < chunks; ++c) {
    std::vector<CompressedTile> compressed(kTiles);
    std::vector<const CompressedTile*> pointers(kTiles);
    for (std::size_t t = 0; t < kTiles; ++t) {
      const TileRows& rows = tiles[c * kTiles + t];
      if (rows.values.empty()) continue;
      compressed[t] = compress_tile(layout, rows, thresholds);
      pointers[t] = &compressed[t];
      place_rows(c * kTiles + t, rows.color, rows.coverage, tables);
    }
    (*buffers)[c] = assemble_chunk(layout, pointers);
    data->chunks.emplace_back((*buffers)[c]);
    data->chunk_bytes += (*buffers)[c].size();
    energies[c].assign(static_cast<std::size_t>(layout.size()), 0.0);
    add_column_energies(layout, (*buffers)[c], chunk_colors(tables, c), energies[c]);
  }
  data->column_norms = norms_of(energies, static_cast<std::size_t>(layout.size()));
  data->info = std::move(info);
  data->storage = buffers;
  data->row_output = std::move(tables.row_output);
  data->row_color = std::move(tables.row_color);
  data->coverage = std::move(tables.coverage);
  return Transport(std::move(data));
}

}  // namespace haarlight
