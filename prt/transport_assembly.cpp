// From compressed tiles to a transport file.

#include "prt/transport_assembly.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "prt/chunk.h"
#include "prt/prior_lighting.h"
#include "prt/row_tables.h"
#include "prt/size_limit.h"
#include "prt/transport_format.h"

namespace haarlight {
namespace {

constexpr auto kTiles = static_cast<std::size_t>(kChunkTiles);

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

// Whether a record's arrays are those of one tile of this transport.
bool fits(const HaarLayout& layout, const TileRecord& record) {
  const CompressedTile& tile = record.tile;
  const auto size = static_cast<std::size_t>(layout.size());
  if (tile.rgb_blocks > 15 || tile.present.size() != (size + 1) / 2 ||
      record.color.size() != static_cast<std::size_t>(kTileRows) ||
      record.coverage.size() != static_cast<std::size_t>(kTileRows)) {
    return false;
  }
  std::size_t scales = 0;
  for (std::size_t column = 0; column < size; ++column) {
    const unsigned present = tile.present[column / 2] >> (4 * (column % 2)) & 15u;
    for (std::size_t block = 0; block < kTileBlocks; ++block) {
      if (present >> block & 1) scales += tile.rgb_blocks >> block & 1 ? 3 : 1;
    }
  }
  const std::size_t lightings = prior_lightings(layout).size();
  const std::size_t channels = tile.rgb_blocks == 0 ? 1 : 3;
  const std::size_t errors = record.error.error.size();
  return tile.scales.size() == scales && tile.values.size() == scales * kBlockRows &&
         record.error.energy.size() == errors && (errors == 0 || errors == lightings) &&
         record.noise.energy.size() == record.noise.error.size() &&
         (record.noise.error.empty() || record.noise.error.size() == lightings) &&
         (record.pictures.empty() ||
          record.pictures.size() == lightings * channels * static_cast<std::size_t>(kTileRows));
}

// One transport being put together.
class Assembly {
 public:
  Assembly(const std::filesystem::path& file, const AssemblyInput& input)
      : file_(file),
        input_(input),
        layout_(input.head.info.face_size),
        tables_(empty_tables(input.head.info)),
        chunks_(tables_.row_output.size() / kChunkRows) {}

  TransportSummary run(const Progress& progress);

 private:
  using Records = std::vector<std::shared_ptr<const TileRecord>>;

  Records records_of(std::size_t chunk) const;
  // body(chunk, slot) for all chunks, a group at a time; after(chunk, slot) in order.
  template <typename Body, typename After>
  void for_chunks(const Body& body, const After& after) const;
  float choose_threshold();
  std::string describe(std::uint64_t chunk_bytes, const TransportSummary& summary) const;

  const std::filesystem::path& file_;
  const AssemblyInput& input_;
  HaarLayout layout_;
  RowTables tables_;
  std::size_t chunks_;
};

Assembly::Records Assembly::records_of(std::size_t chunk) const {
  Records records(kTiles);
  for (std::size_t t = 0; t < kTiles; ++t) {
    const std::size_t tile = chunk * kTiles + t;
    if (tile >= static_cast<std::size_t>(input_.head.tiles)) break;
    records[t] = input_.record(static_cast<int>(tile));
    if (records[t] && !fits(layout_, *records[t])) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: tile {} is not one of this transport", file_.string(), tile));
    }
  }
  return records;
}

template <typename Body, typename After>
void Assembly::for_chunks(const Body& body, const After& after) const {
  const auto group = static_cast<std::size_t>(std::max(1, input_.workers));
  for (std::size_t first = 0; first < chunks_; first += group) {
    const std::size_t count = std::min(group, chunks_ - first);
    parallel_for(static_cast<int>(count), [&](int i) {
      const auto slot = static_cast<std::size_t>(i);
      body(first + slot, slot);
    });
    for (std::size_t slot = 0; slot < count; ++slot) after(first + slot, slot);
  }
}

// The smallest further threshold at which the file is at most as large as it may be.
float Assembly::choose_threshold() {
  const std::uint64_t most = input_.head.max_bytes;
  if (most == 0) return 0;
  SizeByThreshold total(layout_);
  const auto group = static_cast<std::size_t>(std::max(1, input_.workers));
  std::vector<SizeByThreshold> sizes(group, SizeByThreshold(layout_));
  for_chunks(
      [&](std::size_t chunk, std::size_t slot) {
        const Records records = records_of(chunk);
        std::vector<const CompressedTile*> tiles(kTiles, nullptr);
        for (std::size_t t = 0; t < kTiles; ++t) {
          if (records[t]) tiles[t] = &records[t]->tile;
        }
        sizes[slot] = SizeByThreshold(layout_);
        sizes[slot].add_chunk(tiles);
      },
      [&](std::size_t, std::size_t slot) { total.add(sizes[slot]); });
  const std::uint64_t rest =
      transport_overhead_bytes(input_.head.info) + input_.meta.size() -
      chunks_ * (column_area_begin(static_cast<std::size_t>(layout_.size())));
  for (int level = 0; level < kLimitLevels; ++level) {
    if (total.bytes(level) + rest <= most) return limit_threshold(level);
  }
  throw Error(ErrorKind::invalid_argument,
              fmt::format("{}: {} bytes are too few, expected at least {} for this transport",
                          file_.string(), most, total.bytes(kLimitLevels - 1) + rest));
}

std::string Assembly::describe(std::uint64_t chunk_bytes, const TransportSummary& summary) const {
  nlohmann::json out = nlohmann::json::parse(input_.meta.empty() ? "{}" : input_.meta);
  std::vector<float> thresholds = input_.head.thresholds;
  for (float& t : thresholds) t = std::max(t, summary.size_threshold);
  out["measured_error"] = summary.measured_error;
  out["thresholds"] = thresholds;
  out["bytes"] = chunk_bytes;
  out["complete"] = summary.complete;
  if (!summary.complete) {
    out["tiles"] = input_.head.tiles;
    out["tiles_traced"] = input_.tiles_done;
  }
  if (summary.noise > 0) out["noise"] = summary.noise;
  if (input_.head.max_bytes > 0) out["max_bytes"] = input_.head.max_bytes;
  return out.dump(2);
}

TransportSummary Assembly::run(const Progress& progress) {
  const auto columns = static_cast<std::size_t>(layout_.size());
  const TransportInfo& info = input_.head.info;
  TransportSummary summary;
  summary.complete = input_.tiles_done >= input_.head.tiles;
  AtomicFile out(file_);
  TransportHeader header = header_of(info, chunks_);
  const std::vector<std::byte> blank(kChunkAlignment);
  out.write(blank.data(), sizeof header);
  summary.size_threshold = choose_threshold();

  // Chunks in groups: put together in parallel, written in order.
  std::vector<FileSection> sections(chunks_);
  std::vector<std::vector<double>> energies(chunks_);
  PictureError error;
  PictureError noise;
  struct Slot {
    std::vector<std::byte> bytes;
    PictureError error;
    PictureError noise;
  };
  std::vector<Slot> slots(static_cast<std::size_t>(std::max(1, input_.workers)));
  for_chunks(
      [&](std::size_t chunk, std::size_t slot) {
        Slot& s = slots[slot];
        s.error = {};
        s.noise = {};
        const Records records = records_of(chunk);
        std::vector<CompressedTile> pruned(kTiles);
        std::vector<const CompressedTile*> tiles(kTiles, nullptr);
        for (std::size_t t = 0; t < kTiles; ++t) {
          if (!records[t]) continue;
          const TileRecord& record = *records[t];
          place_rows(chunk * kTiles + t, record.color, record.coverage, tables_);
          s.noise.add(record.noise);
          if (summary.size_threshold > 0) {
            pruned[t] = record.tile;
            prune_tile(layout_, summary.size_threshold, pruned[t]);
            tiles[t] = &pruned[t];
          } else {
            tiles[t] = &record.tile;
          }
          if (tiles[t] == &record.tile || record.pictures.empty()) {
            s.error.add(record.error);
          } else {
            s.error.add(tile_error(layout_, record.pictures, *tiles[t], record.color,
                                   prior_lightings(layout_)));
          }
        }
        s.bytes = assemble_chunk(layout_, tiles);
        energies[chunk].assign(columns, 0.0);
        add_column_energies(layout_, s.bytes, chunk_colors(tables_, chunk), energies[chunk]);
      },
      [&](std::size_t chunk, std::size_t slot) {
        out.write(blank.data(), (kChunkAlignment - out.size() % kChunkAlignment) % kChunkAlignment);
        sections[chunk] = append(out, slots[slot].bytes.data(), slots[slot].bytes.size());
        error.add(slots[slot].error);
        noise.add(slots[slot].noise);
        const double share = static_cast<double>(chunk + 1) / static_cast<double>(chunks_);
        if (progress && !progress(share)) {
          throw Error(ErrorKind::cancelled, fmt::format("{}: stopped on request", file_.string()));
        }
      });
  summary.measured_error = input_.measured_error.value_or(error.worst());
  summary.noise = noise.worst();

  const std::vector<float> norms =
      input_.column_norms.empty() ? norms_of(energies, columns) : input_.column_norms;
  header.column_norms = append(out, norms.data(), norms.size() * sizeof(float));
  const std::vector<std::byte> packed = pack_tables(tables_);
  header.rows = append(out, packed.data(), packed.size());
  header.chunk_table = append(out, sections.data(), sections.size() * sizeof(FileSection));
  if (info.mesh) {
    const std::vector<std::byte> mesh = pack_mesh(*info.mesh);
    header.mesh = append(out, mesh.data(), mesh.size());
  }
  std::vector<NamedSection> named;
  const auto append_named = [&](const char(&section)[8],
                                const std::vector<std::byte>& packed_section) {
    NamedSection& entry = named.emplace_back();
    std::memcpy(entry.name, section, sizeof section);
    entry.section = append(out, packed_section.data(), packed_section.size());
  };
  if (info.view) append_named(kViewFactorsName, pack_view_factors(*info.view));
  if (info.clusters) append_named(kClustersName, pack_cluster_weights(*info.clusters));
  header.named = append(out, named.data(), named.size() * sizeof(NamedSection));
  std::uint64_t chunk_bytes = 0;
  for (const FileSection& section : sections) chunk_bytes += section.size;
  const std::string text = describe(chunk_bytes, summary);
  header.meta = append(out, text.data(), text.size());
  header.file_size = out.size();
  header.header_hash = XXH3_64bits(&header, offsetof(TransportHeader, header_hash));
  out.write_at(0, &header, sizeof header);
  out.commit();
  summary.bytes = header.file_size;
  return summary;
}

}  // namespace

TransportSummary assemble_transport(const std::filesystem::path& file, const AssemblyInput& input,
                                    const Progress& progress) {
  return Assembly(file, input).run(progress);
}

std::uint64_t transport_overhead_bytes(const TransportInfo& info) {
  const HaarLayout layout(info.face_size);
  const auto columns = static_cast<std::uint64_t>(layout.size());
  const std::uint64_t rows = row_order(info).size(), chunks = rows / kChunkRows;
  // zstd adds less than 1/256 and a few hundred bytes to what it cannot pack.
  const auto packed = [](std::uint64_t bytes) { return bytes + bytes / 256 + 1024; };
  constexpr std::uint64_t kMeta = 65536;  // the description, with room for what is added to it
  std::uint64_t bytes = kChunkAlignment + 4 * columns + chunks * sizeof(FileSection) + kMeta;
  bytes +=
      packed(rows * (sizeof(std::uint32_t) + sizeof(Rgb)) + info.output_count() * sizeof(float));
  bytes += chunks * column_area_begin(columns);
  if (info.mesh) bytes += pack_mesh(*info.mesh).size();
  if (info.view) bytes += pack_view_factors(*info.view).size() + sizeof(NamedSection);
  if (info.clusters) bytes += pack_cluster_weights(*info.clusters).size() + sizeof(NamedSection);
  return bytes;
}

void check_info(const TransportInfo& info) {
  if (info.width < 1 || info.height < 1 || info.width > 65536 || info.height > 65536) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture size is {}x{}, expected 1 to 65536 each way", info.width,
                            info.height));
  }
  const bool mesh = info.kind != TransportKind::image;
  const int most = mesh ? kMaxTerms : 1;
  if (info.terms < 1 || info.terms > most) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} terms, expected 1 to {}", info.terms, most));
  }
  if (mesh != (info.mesh != nullptr)) {
    throw Error(ErrorKind::invalid_argument,
                "a mesh is wanted for the transport of a mesh, and for no other");
  }
  if ((info.kind == TransportKind::clusters) != (info.clusters != nullptr)) {
    throw Error(ErrorKind::invalid_argument,
                "clusters are wanted for the transport of clusters, and for no other");
  }
  if (info.view && (!mesh || info.view->terms != info.terms)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("view factors have {} terms, expected a mesh of as many, {}",
                            info.view->terms, info.terms));
  }
  const std::size_t vertices = mesh ? info.mesh->position.size() : 0;
  for (const std::string& wrong :
       {mesh ? check_mesh(*info.mesh) : std::string(),
        info.view ? check_view_factors(*info.view, vertices) : std::string(),
        info.clusters ? check_cluster_weights(*info.clusters, vertices, info.terms)
                      : std::string()}) {
    if (!wrong.empty()) throw Error(ErrorKind::invalid_argument, wrong);
  }
  if (info.output_count() > kMaxOutputs) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} outputs, expected at most {}", info.output_count(), kMaxOutputs));
  }
}

}  // namespace haarlight
