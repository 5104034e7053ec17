// Reading transport files: mapping, checking every byte, and access to columns.

#include "prt/transport.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/chunk.h"
#include "prt/transport_data.h"
#include "prt/transport_format.h"
#include "prt/transport_tables.h"

namespace haarlight {
namespace {

class Mapping {
 public:
  explicit Mapping(const std::filesystem::path& file) {
    const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
      const int reason = errno;
      throw Error(reason == ENOENT ? ErrorKind::missing : ErrorKind::io,
                  fmt::format("{}: {}", file.string(), std::strerror(reason)));
    }
    struct stat status {};
    const bool known = ::fstat(descriptor, &status) == 0;
    if (!known || !S_ISREG(status.st_mode)) {
      ::close(descriptor);
      throw Error(ErrorKind::io, fmt::format("{}: not a plain file", file.string()));
    }
    size_ = static_cast<std::size_t>(status.st_size);
    if (size_ > 0) {
      data_ = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED, descriptor, 0);
    }
    const int reason = errno;
    ::close(descriptor);
    if (data_ == MAP_FAILED) {
      data_ = nullptr;
      throw Error(ErrorKind::io,
                  fmt::format("{}: cannot be mapped: {}", file.string(), std::strerror(reason)));
    }
  }
  ~Mapping() {
    if (data_) ::munmap(data_, size_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

[[noreturn]] void damaged(const std::string& name, const std::string& what) {
  throw Error(ErrorKind::format, fmt::format("{}: {}", name, what));
}

// The bytes of a section, inside the file and with the right hash.
std::span<const std::byte> section_bytes(std::span<const std::byte> file,
                                         const FileSection& section, const std::string& name,
                                         const std::string& what) {
  if (section.offset > file.size() || section.size > file.size() - section.offset) {
    damaged(name, fmt::format("{} at byte {} of {} bytes, past the file's end at {}", what,
                              section.offset, section.size, file.size()));
  }
  const auto bytes = file.subspan(section.offset, section.size);
  if (XXH3_64bits(bytes.data(), bytes.size()) != section.hash) {
    damaged(name, fmt::format("{} is damaged (checksum differs)", what));
  }
  return bytes;
}

TransportHeader read_header(std::span<const std::byte> file, const std::string& name) {
  TransportHeader header;
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
  if (header.file_size != file.size()) {
    damaged(name, fmt::format("{} bytes, expected {}: the file was cut short or grew", file.size(),
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
void read_named(std::span<const std::byte> bytes, const TransportHeader& header,
                const std::string& name, TransportInfo& info) {
  if (header.version < 3) return;
  const auto table = section_bytes(bytes, header.named, name, "table of sections");
  constexpr std::size_t kEntry = sizeof(NamedSection);
  if (table.size() % kEntry != 0 || table.size() / kEntry > kMostNamedSections) {
    damaged(name, "table of sections has the wrong size");
  }
  const std::size_t vertices = info.mesh ? info.mesh->position.size() : 0;
  for (std::size_t at = 0; at < table.size(); at += kEntry) {
    NamedSection entry;
    std::memcpy(&entry, table.data() + at, kEntry);
    const auto is = [&](const char(&wanted)[8]) {
      return std::memcmp(entry.name, wanted, sizeof wanted) == 0;
    };
    const bool view = is(kViewFactorsName), clusters = is(kClustersName);
    const auto section = section_bytes(bytes, entry.section, name,
                                       view       ? "view factors"
                                       : clusters ? "clusters"
                                                  : "a section of unknown name");
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
      info.clusters =
          std::make_shared<const ClusterWeights>(unpack_cluster_weights(section, vertices, name));
    }
  }
  if ((info.kind == TransportKind::clusters) != (info.clusters != nullptr)) {
    damaged(name, "clusters are wanted for a transport of kind 2, and for no other");
  }
}

}  // namespace

Transport Transport::open(const std::filesystem::path& file) {
  const std::string name = file.string();
  const auto mapping = std::make_shared<const Mapping>(file);
  const std::span<const std::byte> bytes = mapping->bytes();

  const TransportHeader header = read_header(bytes, name);
  check_shape(header, name);
  auto data = std::make_shared<Data>(static_cast<int>(header.face_size));
  data->info = info_of(header, section_bytes(bytes, header.meta, name, "description"));
  if (header.kind > 0) {
    data->info.mesh = std::make_shared<const TransportMesh>(
        unpack_mesh(section_bytes(bytes, header.mesh, name, "mesh"),
                    {header.vertices, header.triangles, header.mesh_materials == 1}, name));
  }
  read_named(bytes, header, name, data->info);
  data->storage = mapping;
  data->file_bytes = bytes.size();

  const auto columns = static_cast<std::size_t>(data->layout.size());
  const std::size_t rows = static_cast<std::size_t>(header.chunk_count) * kChunkRows;
  if (data->info.output_count() > rows) {
    damaged(name, fmt::format("{} outputs do not fit {} rows", data->info.output_count(), rows));
  }
  RowTables tables = unpack_tables(section_bytes(bytes, header.rows, name, "row tables"), rows,
                                   data->info.output_count(), name);
  data->row_output = std::move(tables.row_output);
  data->row_color = std::move(tables.row_color);
  data->coverage = std::move(tables.coverage);

  const auto norms = section_bytes(bytes, header.column_norms, name, "column norms");
  if (norms.size() != 4 * columns) damaged(name, "column norms have the wrong size");
  data->column_norms.resize(columns);
  std::memcpy(data->column_norms.data(), norms.data(), norms.size());
  for (float norm : data->column_norms) {
    if (!(norm >= 0) || !std::isfinite(norm)) damaged(name, "a column norm is not a number >= 0");
  }

  const auto table = section_bytes(bytes, header.chunk_table, name, "chunk table");
  if (table.size() != sizeof(FileSection) * header.chunk_count) {
    damaged(name, "chunk table has the wrong size");
  }
  data->chunks.resize(header.chunk_count);
  parallel_for(static_cast<int>(header.chunk_count), [&](int i) {
    const auto c = static_cast<std::size_t>(i);
    FileSection section;
    std::memcpy(&section, table.data() + sizeof section * c, sizeof section);
    const std::string what = fmt::format("chunk {}", c);
    if (section.offset % 16 != 0) damaged(name, what + " is not aligned");
    const auto chunk = section_bytes(bytes, section, name, what);
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
