// From tiles to a transport file, or to a transport in memory.

#include "prt/transport_writer.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "prt/chunk.h"
#include "prt/prior_lighting.h"
#include "prt/tile_journal.h"
#include "prt/tolerance.h"
#include "prt/transport_data.h"
#include "prt/transport_format.h"
#include "prt/transport_tables.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kTiles = static_cast<std::size_t>(kChunkTiles);
constexpr int kMeasureEvery = 8;  // one tile in so many has its error measured

void check_info(const TransportInfo& info) {
  if (info.width < 1 || info.height < 1 || info.width > 65536 || info.height > 65536) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture size is {}x{}, expected 1 to 65536 each way", info.width,
                            info.height));
  }
  const int most = info.kind == TransportKind::mesh ? kMaxTerms : 1;
  if (info.terms < 1 || info.terms > most) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} terms, expected 1 to {}", info.terms, most));
  }
  if ((info.kind == TransportKind::mesh) != (info.mesh != nullptr)) {
    throw Error(ErrorKind::invalid_argument,
                "a mesh is wanted for the transport of a mesh, and for no other");
  }
  const std::string wrong = info.mesh ? check_mesh(*info.mesh) : std::string();
  if (!wrong.empty()) throw Error(ErrorKind::invalid_argument, wrong);
  if (info.output_count() > kMaxOutputs) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} outputs, expected at most {}", info.output_count(), kMaxOutputs));
  }
}

// Colours and coverages of a tile into the tables of all rows.
void place_rows(std::size_t tile, std::span<const Rgb> color, std::span<const float> coverage,
                RowTables& tables) {
  for (std::size_t r = 0; r < kRows; ++r) {
    const std::uint32_t output = tables.row_output[tile * kRows + r];
    tables.row_color[tile * kRows + r] = color[r];
    if (output != kNoOutput) tables.coverage[output] = coverage[r];
  }
}

RowTables empty_tables(const TransportInfo& info) {
  RowTables tables;
  tables.row_output = row_order(info);
  tables.row_color.assign(tables.row_output.size(), Rgb{});
  tables.coverage.assign(info.output_count(), 0.0f);
  return tables;
}

std::vector<float> norms_of(std::span<const std::vector<double>> chunk_energies,
                            std::size_t columns) {
  std::vector<float> norms(columns);
  for (std::size_t j = 0; j < columns; ++j) {
    double sum = 0;
    for (const auto& energies : chunk_energies) sum += energies[j];
    norms[j] = static_cast<float>(std::sqrt(sum));
  }
  return norms;
}

std::span<const Rgb> chunk_colors(const RowTables& tables, std::size_t chunk) {
  return std::span(tables.row_color).subspan(chunk * kChunkRows, kChunkRows);
}

// Tiles up to the last with a row in use.
int used_tiles(std::span<const std::uint32_t> order) {
  std::size_t rows = order.size();
  while (rows > 0 && order[rows - 1] == kNoOutput) --rows;
  return static_cast<int>((rows + kRows - 1) / kRows);
}

// Appends a section and says where it is.
FileSection append(AtomicFile& file, const void* bytes, std::size_t size) {
  FileSection section{file.size(), size, XXH3_64bits(bytes, size)};
  file.write(bytes, size);
  const std::byte zeros[16] = {};
  file.write(zeros, (16 - size % 16) % 16);
  return section;
}

TransportHeader header_of(const TransportInfo& info, std::size_t chunks) {
  TransportHeader header{};
  std::memcpy(header.magic, kTransportMagic, sizeof kTransportMagic);
  header.version = kTransportVersion;
  header.face_size = static_cast<std::uint32_t>(info.face_size);
  header.width = static_cast<std::uint32_t>(info.width);
  header.height = static_cast<std::uint32_t>(info.height);
  header.chunk_count = static_cast<std::uint32_t>(chunks);
  header.kind = static_cast<std::uint32_t>(info.kind);
  header.terms = static_cast<std::uint32_t>(info.terms);
  if (info.mesh) {
    header.vertices = static_cast<std::uint32_t>(info.mesh->position.size());
    header.triangles = static_cast<std::uint32_t>(info.mesh->triangle.size());
    header.mesh_materials = info.mesh->material.empty() ? 0 : 1;
  }
  const Camera& camera = info.camera;
  const double position[3] = {camera.position.x, camera.position.y, camera.position.z};
  std::copy(position, position + 3, header.camera_position);
  for (std::size_t i = 0; i < 3; ++i) {
    header.camera_orientation[3 * i] = camera.orientation.row[i].x;
    header.camera_orientation[3 * i + 1] = camera.orientation.row[i].y;
    header.camera_orientation[3 * i + 2] = camera.orientation.row[i].z;
  }
  header.camera_vertical_fov = camera.vertical_fov;
  return header;
}

}  // namespace

struct TransportWriter::State {
  std::filesystem::path file;
  TransportInfo info;
  TransportWriterOptions options;
  HaarLayout layout;
  std::vector<std::uint32_t> row_order;
  int tiles = 0;
  const std::vector<std::vector<float>>& lightings;
  std::optional<TileJournal> journal;
  bool finished = false;

  State(std::filesystem::path f, TransportInfo i, TransportWriterOptions o)
      : file(std::move(f)),
        info(std::move(i)),
        options(std::move(o)),
        layout(info.face_size),
        lightings(prior_lightings(layout)) {}
};

TransportWriter::TransportWriter(const std::filesystem::path& file, TransportInfo info,
                                 TransportWriterOptions options) {
  check_info(info);
  state_ = std::make_unique<State>(file, std::move(info), std::move(options));
  State& s = *state_;
  if (s.options.thresholds.size() != static_cast<std::size_t>(s.layout.band_count())) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} thresholds, expected {}, one a band", s.options.thresholds.size(),
                            s.layout.band_count()));
  }
  s.row_order = row_order(s.info);
  s.tiles = used_tiles(s.row_order);
  std::string fingerprint = s.options.fingerprint;
  fingerprint += fmt::format("|{}x{}x{}|", s.info.face_size, s.info.width, s.info.height);
  if (s.info.mesh) {
    const std::vector<std::byte> mesh = pack_mesh(*s.info.mesh);
    fingerprint +=
        fmt::format("mesh:{}:{:016x}|", s.info.terms, XXH3_64bits(mesh.data(), mesh.size()));
  }
  for (float threshold : s.options.thresholds) fingerprint += fmt::format("{:a},", threshold);
  std::filesystem::path journal = file;
  journal += ".partial";
  s.journal.emplace(journal, fingerprint, s.tiles, s.options.resume);
}

TransportWriter::~TransportWriter() {
  if (state_ && !state_->finished && state_->journal && state_->journal->count() == 0) {
    state_->journal->remove();
  }
}

int TransportWriter::tile_count() const { return state_->tiles; }

std::span<const std::uint32_t> TransportWriter::tile_outputs(int tile) const {
  return std::span(state_->row_order).subspan(static_cast<std::size_t>(tile) * kRows, kRows);
}

bool TransportWriter::has_tile(int tile) const { return state_->journal->has(tile); }

void TransportWriter::write_tile(int tile, const TileRows& rows) {
  State& s = *state_;
  TileRecord record;
  record.tile = compress_tile(s.layout, rows, s.options.thresholds);
  record.color = rows.color;
  record.coverage = rows.coverage;
  if (tile % kMeasureEvery == 0) {
    record.error = tile_error(s.layout, rows, record.tile, s.lightings);
  }
  s.journal->append(tile, record);
}

void TransportWriter::discard() {
  state_->journal->remove();
  state_->finished = true;
}

void TransportWriter::finish(const std::string& meta, const Progress& progress) {
  State& s = *state_;
  const auto columns = static_cast<std::size_t>(s.layout.size());
  const std::size_t chunks = s.row_order.size() / kChunkRows;
  AtomicFile out(s.file);
  TransportHeader header = header_of(s.info, chunks);
  const std::vector<std::byte> blank(kChunkAlignment);
  out.write(blank.data(), sizeof header);

  // Chunks in groups of the thread count: assembled in parallel, written in order.
  RowTables tables = empty_tables(s.info);
  std::vector<FileSection> sections(chunks);
  std::vector<std::vector<double>> energies(chunks);
  PictureError error;
  const auto group = static_cast<std::size_t>(thread_count());
  std::vector<std::vector<std::byte>> assembled(group);
  std::vector<PictureError> errors(group);
  for (std::size_t first = 0; first < chunks; first += group) {
    const std::size_t count = std::min(group, chunks - first);
    parallel_for(static_cast<int>(count), [&](int i) {
      const auto slot = static_cast<std::size_t>(i);
      const std::size_t chunk = first + slot;
      std::vector<std::optional<TileRecord>> records(kTiles);
      std::vector<const CompressedTile*> tiles(kTiles, nullptr);
      errors[slot] = {};
      for (std::size_t t = 0; t < kTiles; ++t) {
        const std::size_t tile = chunk * kTiles + t;
        if (tile >= static_cast<std::size_t>(s.tiles)) break;
        records[t] = s.journal->read(static_cast<int>(tile));
        if (!records[t]) continue;
        tiles[t] = &records[t]->tile;
        place_rows(tile, records[t]->color, records[t]->coverage, tables);
        errors[slot].add(records[t]->error);
      }
      assembled[slot] = assemble_chunk(s.layout, tiles);
      energies[chunk].assign(columns, 0.0);
      add_column_energies(s.layout, assembled[slot], chunk_colors(tables, chunk), energies[chunk]);
    });
    for (std::size_t slot = 0; slot < count; ++slot) {
      out.write(blank.data(), (kChunkAlignment - out.size() % kChunkAlignment) % kChunkAlignment);
      sections[first + slot] = append(out, assembled[slot].data(), assembled[slot].size());
      error.add(errors[slot]);
    }
    const double share = static_cast<double>(first + count) / static_cast<double>(chunks);
    if (progress && !progress(share)) {
      throw Error(ErrorKind::cancelled, fmt::format("{}: stopped on request", s.file.string()));
    }
  }

  const std::vector<float> norms = norms_of(energies, columns);
  header.column_norms = append(out, norms.data(), norms.size() * sizeof(float));
  const std::vector<std::byte> packed = pack_tables(tables);
  header.rows = append(out, packed.data(), packed.size());
  header.chunk_table = append(out, sections.data(), sections.size() * sizeof(FileSection));
  if (s.info.mesh) {
    const std::vector<std::byte> mesh = pack_mesh(*s.info.mesh);
    header.mesh = append(out, mesh.data(), mesh.size());
  }
  nlohmann::json description = nlohmann::json::parse(meta.empty() ? "{}" : meta);
  std::uint64_t chunk_bytes = 0;
  for (const FileSection& section : sections) chunk_bytes += section.size;
  description["measured_error"] = error.worst();
  description["thresholds"] = s.options.thresholds;
  description["bytes"] = chunk_bytes;
  const std::string text = description.dump(2);
  header.meta = append(out, text.data(), text.size());
  header.file_size = out.size();
  header.header_hash = XXH3_64bits(&header, offsetof(TransportHeader, header_hash));
  out.write_at(0, &header, sizeof header);
  out.commit();
  s.finished = true;
  s.journal->remove();
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
