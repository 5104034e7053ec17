// Transports of meshes: packing, files of both versions, order of rows.

#include "prt/transport_mesh.h"

#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/transport.h"
#include "prt/transport_format.h"
#include "prt/transport_writer.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;
using fixtures::TemporaryFolder;

std::vector<char> bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::filesystem::path& file, const std::vector<char>& bytes) {
  std::ofstream(file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

void write_file(const SmallTransport& small, const std::filesystem::path& file) {
  TransportWriter writer(file, small.info, {small.thresholds, "test", false});
  for (int tile = writer.tile_count(); tile-- > 0;) {
    writer.write_tile(tile, small.tiles[static_cast<std::size_t>(tile)]);
  }
  writer.finish(R"({"made_by": "test"})");
}

std::string refusal(const std::filesystem::path& file) {
  try {
    Transport::open(file);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::format);
    return error.what();
  }
  ADD_FAILURE() << "opened " << file;
  return {};
}

// Writes the header back with the right hash: what a crafted file would have.
void rehash(std::vector<char>& bytes, TransportHeader header) {
  header.header_hash = XXH3_64bits(&header, offsetof(TransportHeader, header_hash));
  std::memcpy(bytes.data(), &header, sizeof header);
}

TransportHeader header_of(const std::vector<char>& bytes) {
  TransportHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  return header;
}

void expect_same_mesh(const TransportMesh& a, const TransportMesh& b) {
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.normal, b.normal);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.material, b.material);
}

TEST(TransportMesh, PacksAndUnpacksToTheSameBits) {
  for (const int vertices : {1, 40, 3000}) {
    TransportMesh mesh = fixtures::bumpy_sphere(vertices, 1);
    mesh.position[0][1] = -0.0f;
    for (const bool materials : {false, true}) {
      if (materials) {
        for (std::uint32_t v = 0; v < mesh.position.size(); ++v) mesh.material.push_back(v % 5);
      }
      const MeshCounts counts{static_cast<std::uint32_t>(mesh.position.size()),
                              static_cast<std::uint32_t>(mesh.triangle.size()), materials};
      const auto packed = pack_mesh(mesh);
      const TransportMesh back = unpack_mesh(packed, counts, "a.hlt");
      expect_same_mesh(back, mesh);
      EXPECT_TRUE(std::signbit(back.position[0][1]));
      for (const MeshCounts& wrong : {MeshCounts{counts.vertices + 1, counts.triangles, materials},
                                      MeshCounts{counts.vertices, counts.triangles + 1, materials},
                                      MeshCounts{counts.vertices, counts.triangles, !materials}}) {
        EXPECT_THROW(unpack_mesh(packed, wrong, "a.hlt"), Error);
      }
    }
  }
}

TEST(TransportMesh, NamesWhatIsWrongWithOne) {
  const TransportMesh right = fixtures::bumpy_sphere(40, 2);
  EXPECT_EQ(check_mesh(right), "");
  EXPECT_NE(check_mesh({}), "");
  TransportMesh mesh = right;
  mesh.triangle[7][1] = static_cast<std::uint32_t>(mesh.position.size());
  EXPECT_NE(check_mesh(mesh).find("triangle 7"), std::string::npos);
  mesh = right;
  mesh.normal[3][2] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(check_mesh(mesh).find("vertex 3"), std::string::npos);
  mesh = right;
  mesh.normal.pop_back();
  EXPECT_NE(check_mesh(mesh), "");
  mesh = right;
  mesh.material = {1, 2};
  EXPECT_NE(check_mesh(mesh), "");
  mesh = right;
  mesh.origin.y = std::numeric_limits<double>::infinity();
  EXPECT_NE(check_mesh(mesh), "");
}

TEST(TransportMesh, IsInsideItsSphere) {
  const TransportMesh mesh = fixtures::bumpy_sphere(500, 3);
  const BoundingSphere sphere = bounding_sphere(mesh);
  EXPECT_GE(sphere.radius, 0.8);
  EXPECT_LE(sphere.radius, 1.2 * std::sqrt(3.0));
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    EXPECT_LE(length(mesh.world(v) - sphere.center), sphere.radius * (1 + 1e-6));
  }
}

TEST(MeshRowOrder, HasEveryOutputOnceInBlocksOfOneTerm) {
  for (const int vertices : {1, 16, 100, 5000}) {
    const TransportMesh mesh = fixtures::bumpy_sphere(vertices, 4);
    for (const std::uint32_t terms : {1u, 3u, 4u}) {
      const auto order = mesh_row_order(mesh, static_cast<int>(terms));
      EXPECT_EQ(order.size() % kChunkRows, 0u);
      std::vector<int> seen(mesh.position.size() * terms, 0);
      std::size_t last = 0;
      for (std::size_t row = 0; row < order.size(); ++row) {
        if (order[row] == kNoOutput) continue;
        last = row;
        ++seen.at(order[row]);
        EXPECT_EQ(order[row] % terms, order[row / kBlockRows * kBlockRows] % terms);
      }
      EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
      EXPECT_LT(last, (mesh.position.size() + kBlockRows) * terms);  // padding at the end alone
    }
  }
}

// A block's 16 vertices lie near each other and face the same way. On a sphere of n vertices a
// fair share of the surface is 16 / n of 4 pi: a cap of angle 2 sqrt(16 / n). Cuts that halve the
// longer side leave shapes of up to 2 : 1 or so; four such radii hold on the mean.
TEST(MeshRowOrder, BlocksAreSmall) {
  TransportMesh mesh = fixtures::bumpy_sphere(8000, 5);
  const auto order = mesh_row_order(mesh);
  const double cap = 2 * std::sqrt(16.0 / static_cast<double>(mesh.position.size()));
  double sum = 0;
  int blocks = 0;
  for (std::size_t first = 0; first + kBlockRows <= mesh.position.size(); first += kBlockRows) {
    double widest = 0;
    for (std::size_t i = 0; i < kBlockRows; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto &a = mesh.normal[order[first + i]], &b = mesh.normal[order[first + j]];
        widest = std::max(
            widest, std::hypot(static_cast<double>(a[0] - b[0]), static_cast<double>(a[1] - b[1]),
                               static_cast<double>(a[2] - b[2])));
      }
    }
    sum += widest;
    ++blocks;
  }
  EXPECT_LT(sum / blocks, 4 * cap);

  // Two sides of one sheet see different light: their vertices share no block.
  TransportMesh sheet;
  for (int side = 0; side < 2; ++side) {
    for (int i = 0; i < 1024; ++i) {
      sheet.position.push_back({static_cast<float>(i % 32), 0, static_cast<float>(i / 32)});
      sheet.normal.push_back({0, side == 0 ? 1.0f : -1.0f, 0});
    }
  }
  const auto rows = mesh_row_order(sheet);
  for (std::size_t row = 0; row < 2048; ++row) {
    EXPECT_EQ(rows[row] / 1024, rows[row / kBlockRows * kBlockRows] / 1024);
  }
}

TEST(MeshTransportFile, ReadsBackWhatWasWritten) {
  const TemporaryFolder folder;
  for (const int terms : {1, 3}) {
    const SmallTransport small =
        fixtures::small_mesh_transport(8, fixtures::bumpy_sphere(700, 6), 6, terms);
    const int before = thread_count();
    set_thread_count(1);
    write_file(small, folder / "a.hlt");
    set_thread_count(7);
    write_file(small, folder / "b.hlt");
    set_thread_count(before);
    EXPECT_EQ(bytes_of(folder / "a.hlt"), bytes_of(folder / "b.hlt"));

    const Transport file = Transport::open(folder / "a.hlt");
    const Transport memory = build_transport(small.info, small.tiles, small.thresholds);
    EXPECT_EQ(file.kind(), TransportKind::mesh);
    EXPECT_EQ(file.info().terms, terms);
    EXPECT_EQ(file.width(), small.info.width);
    ASSERT_NE(file.info().mesh, nullptr);
    expect_same_mesh(*file.info().mesh, *small.info.mesh);
    EXPECT_EQ(file.info().output_count(),
              small.info.mesh->position.size() * static_cast<std::size_t>(terms));
    EXPECT_TRUE(std::ranges::equal(file.row_output(), memory.row_output()));
    EXPECT_TRUE(std::ranges::equal(file.row_color(), memory.row_color()));
    EXPECT_TRUE(std::ranges::equal(file.column_norms(), memory.column_norms()));
    EXPECT_EQ(file.coverage().size(), file.info().output_count());
    for (const float c : file.coverage()) EXPECT_EQ(c, 1.0f);
  }
}

TEST(MeshTransportFile, JournalsOfAnotherMeshAreNotContinued) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(100, 7), 7);
  {
    TransportWriter writer(folder / "a.hlt", small.info, {small.thresholds, "test", false});
    writer.write_tile(1, small.tiles[1]);
  }
  TransportMesh moved = *small.info.mesh;
  moved.position[5][0] += 0.25f;
  TransportInfo other = small.info;
  other.mesh = std::make_shared<const TransportMesh>(moved);
  {
    TransportWriter same(folder / "a.hlt", small.info, {small.thresholds, "test", true});
    EXPECT_TRUE(same.has_tile(1));
  }
  TransportWriter writer(folder / "a.hlt", other, {small.thresholds, "test", true});
  EXPECT_FALSE(writer.has_tile(1));
}

TEST(MeshTransportFile, VersionOneIsStillRead) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_transport(4, 24, 16, 8);
  write_file(small, folder / "a.hlt");
  // A picture's header of version 1 is that of version 2 up to the hash, which came earlier.
  std::vector<char> bytes = bytes_of(folder / "a.hlt");
  const std::uint32_t version = 1;
  std::memcpy(bytes.data() + 8, &version, sizeof version);
  std::memset(bytes.data() + kTransportHeader1Hash, 0,
              sizeof(TransportHeader) - kTransportHeader1Hash);
  const std::uint64_t hash = XXH3_64bits(bytes.data(), kTransportHeader1Hash);
  std::memcpy(bytes.data() + kTransportHeader1Hash, &hash, sizeof hash);
  write_bytes(folder / "old.hlt", bytes);

  const Transport now = Transport::open(folder / "a.hlt"),
                  old = Transport::open(folder / "old.hlt");
  EXPECT_EQ(old.kind(), TransportKind::image);
  EXPECT_EQ(old.info().terms, 1);
  EXPECT_EQ(old.info().mesh, nullptr);
  EXPECT_EQ(old.width(), 24);
  EXPECT_EQ(old.info().meta, now.info().meta);
  EXPECT_TRUE(std::ranges::equal(old.row_output(), now.row_output()));
  EXPECT_TRUE(std::ranges::equal(old.coverage(), now.coverage()));
  EXPECT_TRUE(std::ranges::equal(old.column_norms(), now.column_norms()));

  bytes[8] = 4;
  write_bytes(folder / "new.hlt", bytes);
  const std::string message = refusal(folder / "new.hlt");
  EXPECT_NE(message.find("version 4"), std::string::npos) << message;
  EXPECT_NE(message.find("versions 1 to 3"), std::string::npos) << message;
}

TEST(MeshTransportFile, VersionTwoIsStillRead) {
  const TemporaryFolder folder;
  const SmallTransport small =
      fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(100, 8), 8, 2);
  write_file(small, folder / "a.hlt");
  // A header of version 2 is that of version 3 up to the hash, which stood where `named` stands.
  std::vector<char> bytes = bytes_of(folder / "a.hlt");
  const std::uint32_t version = 2;
  std::memcpy(bytes.data() + 8, &version, sizeof version);
  std::memset(bytes.data() + kTransportHeader2Hash, 0,
              sizeof(TransportHeader) - kTransportHeader2Hash);
  const std::uint64_t hash = XXH3_64bits(bytes.data(), kTransportHeader2Hash);
  std::memcpy(bytes.data() + kTransportHeader2Hash, &hash, sizeof hash);
  write_bytes(folder / "old.hlt", bytes);
  const Transport now = Transport::open(folder / "a.hlt"),
                  old = Transport::open(folder / "old.hlt");
  EXPECT_EQ(old.kind(), TransportKind::mesh);
  EXPECT_EQ(old.info().terms, 2);
  EXPECT_EQ(old.info().view, nullptr);
  expect_same_mesh(*old.info().mesh, *now.info().mesh);
  EXPECT_TRUE(std::ranges::equal(old.row_output(), now.row_output()));
  EXPECT_TRUE(std::ranges::equal(old.column_norms(), now.column_norms()));
}

TEST(MeshTransportFile, SectionsOfUnknownNameArePassedOver) {
  const TemporaryFolder folder;
  SmallTransport small = fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(100, 8), 8, 2);
  small.info.view = std::make_shared<const ViewFactors>(
      fixtures::random_view_factors(small.info.mesh->position.size(), 2, 8));
  write_file(small, folder / "a.hlt");
  const std::vector<char> right = bytes_of(folder / "a.hlt");
  const TransportHeader header = header_of(right);
  ASSERT_EQ(header.named.size, sizeof(NamedSection));
  NamedSection entry;
  std::memcpy(&entry, right.data() + header.named.offset, sizeof entry);
  // Writes the table anew, with the right hashes.
  const auto with_table = [&](const std::vector<NamedSection>& table) {
    std::vector<char> bytes = right;
    TransportHeader changed = header;
    changed.named = {bytes.size(), table.size() * sizeof(NamedSection),
                     XXH3_64bits(table.data(), table.size() * sizeof(NamedSection))};
    bytes.resize(bytes.size() + changed.named.size);
    std::memcpy(bytes.data() + changed.named.offset, table.data(), changed.named.size);
    changed.file_size = bytes.size();
    rehash(bytes, changed);
    write_bytes(folder / "b.hlt", bytes);
  };
  NamedSection unknown = entry;
  std::memcpy(unknown.name, "tomorrow", 8);
  with_table({unknown, entry});
  EXPECT_EQ(*Transport::open(folder / "b.hlt").info().view, *small.info.view);
  with_table({unknown});
  EXPECT_EQ(Transport::open(folder / "b.hlt").info().view, nullptr);
  with_table({entry, entry});
  EXPECT_NE(refusal(folder / "b.hlt").find("twice"), std::string::npos);
  NamedSection clusters = entry;
  std::memcpy(clusters.name, kClustersName, 8);
  with_table({clusters});
  refusal(folder / "b.hlt");
  NamedSection outside = unknown;
  outside.section.size = ~std::uint64_t{0};
  with_table({outside});
  EXPECT_NE(refusal(folder / "b.hlt").find("past the file's end"), std::string::npos);
  NamedSection damaged = unknown;
  damaged.section.hash ^= 1;
  with_table({damaged});
  EXPECT_NE(refusal(folder / "b.hlt").find("damaged"), std::string::npos);
  with_table(std::vector<NamedSection>(65, unknown));
  EXPECT_NE(refusal(folder / "b.hlt").find("wrong size"), std::string::npos);
}

TEST(MeshTransportFile, DamageIsATypedError) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_mesh_transport(2, fixtures::bumpy_sphere(90, 9), 9);
  write_file(small, folder / "a.hlt");
  const std::vector<char> right = bytes_of(folder / "a.hlt");
  const TransportHeader header = header_of(right);

  for (std::size_t at = 0; at < header.mesh.size; at += 7) {
    std::vector<char> bytes = right;
    bytes[header.mesh.offset + at] = static_cast<char>(bytes[header.mesh.offset + at] ^ 4);
    write_bytes(folder / "bad.hlt", bytes);
    EXPECT_NE(refusal(folder / "bad.hlt").find("mesh is damaged"), std::string::npos);
  }
  for (std::size_t length = 0; length < sizeof(TransportHeader) + 8; ++length) {
    write_bytes(folder / "cut.hlt", {right.begin(), right.begin() + static_cast<long>(length)});
    refusal(folder / "cut.hlt");
  }

  // Crafted headers, their hashes right: sizes that the file cannot hold, or that contradict.
  const auto crafted = [&](auto change) {
    TransportHeader bad = header;
    change(bad);
    std::vector<char> bytes = right;
    rehash(bytes, bad);
    write_bytes(folder / "bad.hlt", bytes);
    return refusal(folder / "bad.hlt");
  };
  crafted([](TransportHeader& h) { h.vertices = 0xffffffffu; });
  crafted([](TransportHeader& h) { h.vertices = 0; });
  crafted([](TransportHeader& h) { h.vertices -= 1; });
  crafted([](TransportHeader& h) { h.triangles = 0xffffffffu; });
  crafted([](TransportHeader& h) { h.triangles += 1; });
  crafted([](TransportHeader& h) { h.mesh_materials = 1; });
  crafted([](TransportHeader& h) { h.mesh_materials = 2; });
  crafted([](TransportHeader& h) { h.terms = 0; });
  crafted([](TransportHeader& h) { h.terms = 0xffffffffu; });
  crafted([](TransportHeader& h) { h.kind = 0; });
  crafted([](TransportHeader& h) { h.kind = 2; });
  crafted([](TransportHeader& h) { h.kind = 3; });
  crafted([](TransportHeader& h) { h.mesh.size = ~std::uint64_t{0}; });
}

TEST(MeshTransportFile, RefusesToWriteWhatItWouldNotRead) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_mesh_transport(2, fixtures::bumpy_sphere(90, 9), 9);
  const auto refused = [&](const TransportInfo& info) {
    try {
      TransportWriter(folder / "a.hlt", info, {small.thresholds, "test", false});
    } catch (const Error& error) {
      return error.kind() == ErrorKind::invalid_argument;
    }
    return false;
  };
  TransportInfo info = small.info;
  info.mesh = nullptr;
  EXPECT_TRUE(refused(info));
  info = small.info;
  info.kind = TransportKind::image;
  EXPECT_TRUE(refused(info));
  info = small.info;
  info.terms = 0;
  EXPECT_TRUE(refused(info));
  info = fixtures::small_transport(2, 8, 8, 1).info;
  info.terms = 2;
  EXPECT_TRUE(refused(info));
}

}  // namespace
}  // namespace haarlight
