// Reading transport files: checking every byte, and access to columns.

#include "prt/transport.h"

#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/huge_page_vector.h"
#include "core/input_file.h"
#include "core/json_depth.h"
#include "core/parallel.h"
#include "prt/chunk.h"
#include "prt/transport_data.h"
#include "prt/transport_format.h"
#include "prt/transport_tables.h"

namespace haarlight {
namespace {

// The system grants more memory than there is, and kills whoever uses it.
void check_memory(std::uint64_t size, const std::string& name) {
  const auto pages = static_cast<std::uint64_t>(std::max(0L, ::sysconf(_SC_PHYS_PAGES)));
  const auto page = static_cast<std::uint64_t>(std::max(0L, ::sysconf(_SC_PAGESIZE)));
  if (size > pages * page) {
    throw Error(ErrorKind::io, fmt::format("{}: needs {} bytes of memory, this machine has {}",
                                           name, size, pages * page));
  }
}

/// Memory of the chunks, in huge pages. Nothing is written to it before it is read into: pages go
/// to the node of the thread that reads them.
class ChunkMemory {
 public:
  ChunkMemory(std::size_t size, const std::string& name) : size_(size) {
    check_memory(size, name);
    if (size > 0) data_ = HugePageAllocator<std::byte>().allocate(size);
  }
  ~ChunkMemory() {
    if (data_) HugePageAllocator<std::byte>().deallocate(data_, size_);
  }
  ChunkMemory(const ChunkMemory&) = delete;
  ChunkMemory& operator=(const ChunkMemory&) = delete;

  std::span<std::byte> part(std::size_t offset, std::size_t size) const {
    return {data_ + offset, size};
  }

 private:
  std::byte* data_ = nullptr;
  std::size_t size_ = 0;
};

[[noreturn]] void damaged(const std::string& name, const std::string& what) {
  throw Error(ErrorKind::format, fmt::format("{}: {}", name, what));
}

// Reads a section into `bytes`, which has its size, and compares its hash.
void read_section(const InputFile& file, const FileSection& section, std::span<std::byte> bytes,
                  const std::string& name, const std::string& what) {
  file.read(section.offset, bytes);
  if (XXH3_64bits(bytes.data(), bytes.size()) != section.hash) {
    damaged(name, fmt::format("{} is damaged (checksum differs)", what));
  }
}

void check_place(const InputFile& file, const FileSection& section, const std::string& name,
                 const std::string& what) {
  if (section.offset > file.size() || section.size > file.size() - section.offset) {
    damaged(name, fmt::format("{} at byte {} of {} bytes, past the file's end at {}", what,
                              section.offset, section.size, file.size()));
  }
}

/// Room for the description, and for named sections: as many bytes, and some for every vertex.
constexpr std::uint64_t kMaxMetaBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMaxNamedBytes = std::uint64_t{1} << 30, kMaxNamedVertexBytes = 2048;

// The bytes of a section, inside the file, of at most `most` bytes and with the right hash.
std::vector<std::byte> section_bytes(const InputFile& file, const FileSection& section,
                                     const std::string& name, const std::string& what,
                                     std::uint64_t most) {
  check_place(file, section, name, what);
  if (section.size > most) {
    damaged(name, fmt::format("{} has the wrong size: {} bytes, expected at most {}", what,
                              section.size, most));
  }
  check_memory(section.size, name);
  std::vector<std::byte> bytes(section.size);
  read_section(file, section, bytes, name, what);
  return bytes;
}

TransportHeader read_header(const InputFile& input, const std::string& name) {
  TransportHeader header;
  std::vector<std::byte> file(std::min<std::uint64_t>(input.size(), sizeof header));
  input.read(0, file);
  if (file.size() < sizeof header.magic ||
      std::memcmp(file.data(), kTransportMagic, sizeof kTransportMagic) != 0) {
    damaged(name, "not a Haarlight transport file");
  }
  const auto cut = [&] {
    damaged(name, fmt::format("cut short at {} bytes, inside the header", file.size()));
  };
  if (file.size() < kTransportHeader1Hash + sizeof header.header_hash) cut();
  std::memcpy(&header.version, file.data() + sizeof header.magic, sizeof header.version);
  if (header.version < 1 || header.version > kTransportVersion) {
    damaged(name, fmt::format("transport format version {}, this program reads versions 1 to {}",
                              header.version, kTransportVersion));
  }
  const bool first = header.version == 1;
  const std::size_t hashed = first                 ? kTransportHeader1Hash
                             : header.version == 2 ? kTransportHeader2Hash
                                                   : offsetof(TransportHeader, header_hash);
  if (file.size() < hashed + sizeof header.header_hash) cut();
  header = {};
  std::memcpy(&header, file.data(), hashed);
  std::memcpy(&header.header_hash, file.data() + hashed, sizeof header.header_hash);
  if (XXH3_64bits(file.data(), hashed) != header.header_hash) {
    damaged(name, "header is damaged (checksum differs)");
  }
  if (first) header.terms = 1;
  if (header.file_size != input.size()) {
    damaged(name, fmt::format("{} bytes, expected {}: the file was cut short or grew", input.size(),
                              header.file_size));
  }
  return header;
}

TransportInfo info_of(const TransportHeader& header, std::span<const std::byte> meta) {
  TransportInfo info;
  info.kind = static_cast<TransportKind>(header.kind);
  info.terms = static_cast<int>(header.terms);
  info.face_size = static_cast<int>(header.face_size);
  info.width = static_cast<int>(header.width);
  info.height = static_cast<int>(header.height);
  const double* p = header.camera_position;
  const double* o = header.camera_orientation;
  info.camera.position = {p[0], p[1], p[2]};
  info.camera.orientation =
      Rotation{{Vec3{o[0], o[1], o[2]}, Vec3{o[3], o[4], o[5]}, Vec3{o[6], o[7], o[8]}}};
  info.camera.vertical_fov = header.camera_vertical_fov;
  info.camera.width = info.width;
  info.camera.height = info.height;
  info.meta.assign(reinterpret_cast<const char*>(meta.data()), meta.size());
  return info;
}

void check_shape(const TransportHeader& header, const std::string& name) {
  if (header.face_size < 1 || header.face_size > 1024 || !std::has_single_bit(header.face_size)) {
    damaged(name,
            fmt::format("face size {}, expected a power of two from 1 to 1024", header.face_size));
  }
  if (header.kind > 2) {
    damaged(name,
            fmt::format("kind {}, expected 0 (picture), 1 (mesh) or 2 (clusters)", header.kind));
  }
  const bool mesh = header.kind > 0;
  const std::uint32_t most_terms = mesh ? kMaxTerms : 1;
  if (header.terms < 1 || header.terms > most_terms) {
    damaged(name, fmt::format("{} terms, expected 1 to {}", header.terms, most_terms));
  }
  if (mesh != (header.vertices > 0) || (!mesh && (header.triangles > 0 || header.mesh.size > 0)) ||
      header.mesh_materials > (mesh ? 1u : 0u)) {
    damaged(name, fmt::format("{} vertices and {} triangles do not fit a transport of kind {}",
                              header.vertices, header.triangles, header.kind));
  }
  const std::uint64_t outputs =  // of clusters: known when they are read
      (header.kind == 2 ? 0
       : mesh           ? header.vertices
                        : std::uint64_t{header.width} * header.height) *
      header.terms;
  const std::uint64_t rows = std::uint64_t{header.chunk_count} * kChunkRows;
  const std::uint64_t columns = std::uint64_t{6} * header.face_size * header.face_size;
  // A chunk has at least its table of offsets: this bounds every allocation by the file's size.
  if (header.width == 0 || header.height == 0 || header.width > 65536 || header.height > 65536 ||
      outputs > rows || header.chunk_count > header.file_size / (4 * columns) ||
      rows > 0x7fffffffu) {
    damaged(name, fmt::format(
                      "{} x {} pixels, {} outputs in {} chunks do not fit a file of {} bytes",
                      header.width, header.height, outputs, header.chunk_count, header.file_size));
  }
}

// View factors and clusters, where the file has them.
void read_named(const InputFile& input, const TransportHeader& header, const std::string& name,
                TransportInfo& info) {
  if (header.version < 3) return;
  constexpr std::size_t kEntry = sizeof(NamedSection);
  const auto table =
      section_bytes(input, header.named, name, "table of sections", kEntry * kMostNamedSections);
  if (table.size() % kEntry != 0) damaged(name, "table of sections has the wrong size");
  const std::size_t vertices = info.mesh ? info.mesh->position.size() : 0;
  for (std::size_t at = 0; at < table.size(); at += kEntry) {
    NamedSection entry;
    std::memcpy(&entry, table.data() + at, kEntry);
    const auto is = [&](const char(&wanted)[8]) {
      return std::memcmp(entry.name, wanted, sizeof wanted) == 0;
    };
    const bool view = is(kViewFactorsName), clusters = is(kClustersName);
    const auto section = section_bytes(input, entry.section, name,
                                       view       ? "view factors"
                                       : clusters ? "clusters"
                                                  : "a section of unknown name",
                                       kMaxNamedBytes + kMaxNamedVertexBytes * vertices);
    if ((view && info.view) || (clusters && info.clusters)) {
      damaged(name, "a section is there twice");
    }
    if ((view || clusters) && !info.mesh) {
      damaged(name, "view factors or clusters do not fit a transport of kind 0");
    }
    if (view) {
      info.view = std::make_shared<const ViewFactors>(
          unpack_view_factors(section, info.terms, vertices, name));
    } else if (clusters) {
      info.clusters = std::make_shared<const ClusterWeights>(
          unpack_cluster_weights(section, vertices, info.terms, name));
    }
  }
  if ((info.kind == TransportKind::clusters) != (info.clusters != nullptr)) {
    damaged(name, "clusters are wanted for a transport of kind 2, and for no other");
  }
}

void check_camera(const TransportHeader& header, const std::string& name) {
  double sum = 0;  // not finite if one of them is not
  for (const double x : header.camera_position) sum += 0 * x;
  for (const double x : header.camera_orientation) sum += 0 * x;
  if (sum != 0 || !(header.camera_vertical_fov > 0 && header.camera_vertical_fov < kPi)) {
    damaged(name, "the camera has numbers that are not finite, or no angle of view from 0 to pi");
  }
}

// Chunks follow each other, so that a crafted table can ask for no more work than the file has
// bytes.
std::vector<FileSection> read_chunk_table(const InputFile& input, const TransportHeader& header,
                                          const std::string& name) {
  std::vector<FileSection> sections(header.chunk_count);
  const std::size_t size = sizeof(FileSection) * sections.size();
  const auto table = section_bytes(input, header.chunk_table, name, "chunk table", size);
  if (table.size() != size) damaged(name, "chunk table has the wrong size");
  if (size > 0) std::memcpy(sections.data(), table.data(), size);
  std::uint64_t end = 0;
  for (std::size_t c = 0; c < sections.size(); ++c) {
    const std::string what = fmt::format("chunk {}", c);
    check_place(input, sections[c], name, what);
    if (sections[c].offset % kChunkAlignment != 0 || sections[c].offset < end) {
      damaged(name, fmt::format("{} at byte {}, expected a multiple of {} from {} on", what,
                                sections[c].offset, kChunkAlignment, end));
    }
    end = sections[c].offset + sections[c].size;
  }
  return sections;
}

}  // namespace

Transport Transport::open(const std::filesystem::path& file) {
  const std::string name = file.string();
  const InputFile input(file);

  // Small things first: whatever is wrong is found before the chunks cost time or memory.
  const TransportHeader header = read_header(input, name);
  check_shape(header, name);
  check_camera(header, name);
  auto data = std::make_shared<Data>(static_cast<int>(header.face_size));
  data->info =
      info_of(header, section_bytes(input, header.meta, name, "description", kMaxMetaBytes));
  if (json_nests_too_deep(data->info.meta)) damaged(name, "description nests too deep");
  const std::vector<FileSection> sections = read_chunk_table(input, header, name);
  if (header.kind > 0) {
    data->info.mesh = std::make_shared<const TransportMesh>(
        unpack_mesh(section_bytes(input, header.mesh, name, "mesh",
                                  ZSTD_compressBound(24 + std::size_t{28} * header.vertices +
                                                     std::size_t{12} * header.triangles)),
                    {header.vertices, header.triangles, header.mesh_materials == 1}, name));
  }
  read_named(input, header, name, data->info);
  data->file_bytes = input.size();

  const auto columns = static_cast<std::size_t>(data->layout.size());
  const std::size_t rows = static_cast<std::size_t>(header.chunk_count) * kChunkRows;
  if (data->info.output_count() > rows) {
    damaged(name, fmt::format("{} outputs do not fit {} rows", data->info.output_count(), rows));
  }
  RowTables tables = unpack_tables(
      section_bytes(input, header.rows, name, "row tables", ZSTD_compressBound(20 * rows)), rows,
      data->info.output_count(), name);
  if (data->info.kind == TransportKind::clusters) {
    // Clusters find their rows by number, and have their colours at vertices.
    for (std::size_t i = 0; i < data->info.output_count(); ++i) {
      const Rgb& c = tables.row_color[i];
      if (tables.row_output[i] != i || c.r != c.g || c.r != c.b) {
        damaged(name, fmt::format("row {} of clusters is out of order or coloured", i));
      }
    }
  }
  data->row_output = std::move(tables.row_output);
  data->row_color = std::move(tables.row_color);
  data->coverage = std::move(tables.coverage);

  const auto norms = section_bytes(input, header.column_norms, name, "column norms", 4 * columns);
  if (norms.size() != 4 * columns) damaged(name, "column norms have the wrong size");
  data->column_norms.resize(columns);
  std::memcpy(data->column_norms.data(), norms.data(), norms.size());
  for (float norm : data->column_norms) {
    if (!(norm >= 0) || !std::isfinite(norm)) damaged(name, "a column norm is not a number >= 0");
  }

  // Chunks lie in memory one after the other, each from a cache line on.
  constexpr std::size_t kLine = 64;
  std::vector<std::size_t> place(sections.size() + 1, 0);
  for (std::size_t c = 0; c < sections.size(); ++c) {
    place[c + 1] = place[c] + (sections[c].size + kLine - 1) / kLine * kLine;
  }
  const auto memory = std::make_shared<const ChunkMemory>(place.back(), name);
  data->storage = memory;
  data->chunks.resize(sections.size());
  parallel_for(static_cast<int>(sections.size()), [&](int i) {
    const auto c = static_cast<std::size_t>(i);
    const std::string what = fmt::format("chunk {}", c);
    const std::span<std::byte> chunk = memory->part(place[c], sections[c].size);
    read_section(input, sections[c], chunk, name, what);
    const std::string wrong = check_chunk(data->layout, chunk);
    if (!wrong.empty()) damaged(name, what + ": " + wrong);
    data->chunks[c] = chunk;
  });
  for (const auto& chunk : data->chunks) data->chunk_bytes += chunk.size();
  return Transport(std::move(data));
}

Transport::Transport(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

const HaarLayout& Transport::layout() const { return data_->layout; }
const TransportInfo& Transport::info() const { return data_->info; }
int Transport::rows() const { return chunk_count() * kChunkRows; }
int Transport::chunk_count() const { return static_cast<int>(data_->chunks.size()); }
std::uint64_t Transport::chunk_bytes() const { return data_->chunk_bytes; }
std::uint64_t Transport::file_bytes() const { return data_->file_bytes; }
std::span<const std::uint32_t> Transport::row_output() const { return data_->row_output; }
std::span<const Rgb> Transport::row_color() const { return data_->row_color; }
std::span<const float> Transport::coverage() const { return data_->coverage; }
std::span<const float> Transport::column_norms() const { return data_->column_norms; }

const std::uint64_t* Transport::rgb_blocks(int chunk) const {
  return reinterpret_cast<const std::uint64_t*>(
      data_->chunks[static_cast<std::size_t>(chunk)].data());
}

ColumnBlocks Transport::column(int chunk, int index) const {
  return chunk_column(data_->chunks[static_cast<std::size_t>(chunk)].data(), index);
}

std::uint64_t Transport::column_bytes(int index) const {
  std::uint64_t bytes = 0;
  for (const auto& chunk : data_->chunks) {
    std::uint32_t range[2];
    std::memcpy(range, chunk.data() + kChunkHeaderBytes + 4 * static_cast<std::size_t>(index), 8);
    bytes += std::uint64_t{16} * (range[1] - range[0]);
  }
  return bytes;
}

void add_column_energies(const HaarLayout& layout, std::span<const std::byte> chunk,
                         std::span<const Rgb> color, std::span<double> sums) {
  std::uint64_t rgb[4];
  std::memcpy(rgb, chunk.data(), sizeof rgb);
  std::vector<float> weight(kChunkRows);
  for (std::size_t r = 0; r < weight.size(); ++r) {
    weight[r] = color[r].r * color[r].r + color[r].g * color[r].g + color[r].b * color[r].b;
  }
  for (int column = 0; column < layout.size(); ++column) {
    const ColumnBlocks blocks = chunk_column(chunk.data(), column);
    if (!blocks.present) continue;
    double sum = 0;
    std::size_t next = 0;
    for (int w = 0; w < 4; ++w) {
      for (std::uint64_t bits = blocks.present[w]; bits; bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        const bool is_rgb = rgb[w] >> bit & 1;
        const float* row = weight.data() + (64 * w + bit) * kBlockRows;
        for (int ch = 0; ch < (is_rgb ? 3 : 1); ++ch, ++next) {
          const float scale = scale_from_bits(blocks.scales[next]);
          float energy = 0;
          for (std::size_t r = 0; r < static_cast<std::size_t>(kBlockRows); ++r) {
            const auto q = static_cast<float>(blocks.values[next * kBlockRows + r]);
            energy += q * q * (is_rgb ? 1.0f : row[r]);
          }
          sum += static_cast<double>(energy) * scale * scale;
        }
      }
    }
    sums[static_cast<std::size_t>(column)] += sum;
  }
}

}  // namespace haarlight
