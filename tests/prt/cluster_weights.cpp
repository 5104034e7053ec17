// Weights of clustered PCA: packed, checked, kept in files.

#include "prt/cluster_weights.h"

#include <gtest/gtest.h>
#include <xxhash.h>

#include <cstring>
#include <limits>
#include <random>
#include <span>
#include <string>

#include "core/error.h"
#include "prt/picture_relighter.h"
#include "prt/transport_format.h"
#include "prt/transport_tables.h"
#include "prt/transport_writer.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

// Five clusters, the fourth without vertices and the last without vectors.
ClusterWeights some_weights(std::uint32_t vertices, int bits, int terms) {
  std::mt19937_64 random(3);
  ClusterWeights w;
  w.bits = bits;
  w.first_vertex = {0, 7, 20, vertices - 5, vertices - 5, vertices};
  w.first_vector = {0, 4, 6, 9, 10, 10};
  for (std::uint32_t v = 0; v < vertices; ++v) w.vertex.push_back((v * 7 + 3) % vertices);
  for (std::uint32_t i = 0; i < 10; ++i) w.scale.push_back(0.25f * static_cast<float>(i + 1));
  const int most = bits == 8 ? 127 : 32767;
  for (std::size_t i = w.weight_begin().back(); i > 0; --i) {
    w.weight.push_back(static_cast<std::int16_t>(
        static_cast<int>(random() % static_cast<unsigned>(2 * most + 1)) - most));
  }
  for (std::size_t i = 0; i < vertices * static_cast<std::size_t>(terms); ++i) {
    w.tint.push_back(ClusterWeights::tint_bits({0.5f, 1.25f, 0.01f * static_cast<float>(i % 90)}));
  }
  return w;
}

TEST(ClusterWeights, PackAndUnpackToTheSame) {
  for (const int bits : {8, 16}) {
    const ClusterWeights right = some_weights(50, bits, 3);
    ASSERT_EQ(check_cluster_weights(right, 50, 3), "");
    const std::vector<std::byte> packed = pack_cluster_weights(right);
    EXPECT_EQ(unpack_cluster_weights(packed, 50, 3, "a"), right);
    EXPECT_THROW(unpack_cluster_weights(packed, 51, 3, "a"), Error);
    EXPECT_THROW(unpack_cluster_weights(packed, 50, 2, "a"), Error);
    for (std::size_t size = 0; size < packed.size(); ++size) {
      EXPECT_THROW(unpack_cluster_weights(std::span(packed).first(size), 50, 3, "a"), Error)
          << size;
    }
  }
}

TEST(ClusterWeights, TintsAreRoundedToHalfAUnit) {
  const Rgb tint{1.7320508f, 0.3333333f, 0};
  const Rgb kept = ClusterWeights::tint_of(ClusterWeights::tint_bits(tint));
  EXPECT_NEAR(kept.r, tint.r, 0.5 * ClusterWeights::kTintUnit);
  EXPECT_NEAR(kept.g, tint.g, 0.5 * ClusterWeights::kTintUnit);
  EXPECT_EQ(kept.b, 0.0f);
  const Rgb white = ClusterWeights::tint_of(ClusterWeights::tint_bits({1, 1, 1}));
  EXPECT_EQ(white, (Rgb{1, 1, 1}));
}

TEST(ClusterWeights, WhatDoesNotFitIsSaid) {
  const ClusterWeights right = some_weights(50, 8, 2);
  const auto refused = [&](const auto& change, const char* words) {
    ClusterWeights bad = right;
    change(bad);
    EXPECT_NE(check_cluster_weights(bad, 50, 2).find(words), std::string::npos)
        << check_cluster_weights(bad, 50, 2);
  };
  refused([](ClusterWeights& w) { w.vertex[3] = w.vertex[4]; }, "in two clusters");
  refused([](ClusterWeights& w) { w.vertex[3] = 50; }, "or not there");
  refused([](ClusterWeights& w) { w.first_vertex[2] = 3; }, "do not fit");
  refused([](ClusterWeights& w) { w.first_vertex = {}; }, "do not fit");
  refused([](ClusterWeights& w) { w.first_vector.back() = 11; }, "do not fit");
  refused([](ClusterWeights& w) { w.weight.pop_back(); }, "weights, expected");
  refused([](ClusterWeights& w) { w.weight[5] = 128; }, "does not fit 8 bits");
  refused([](ClusterWeights& w) { w.bits = 12; }, "12 bits");
  refused([](ClusterWeights& w) { w.scale[1] = std::numeric_limits<float>::infinity(); },
          "not a number");
  refused([](ClusterWeights& w) { w.tint.pop_back(); }, "tints");
  refused(
      [](ClusterWeights& w) {
        w.first_vector = {0, 257, 257, 257, 257, 257};
        w.scale.resize(257);
      },
      "at most 256");
}

TEST(ClusterWeights, FilesKeepThem) {
  const TemporaryFolder folder;
  auto small = fixtures::small_mesh_transport(2, fixtures::bumpy_sphere(100, 17), 17, 2);
  const auto vertices = static_cast<std::uint32_t>(small.info.mesh->position.size());
  const ClusterWeights weights = some_weights(vertices, 16, 2);
  small.info.kind = TransportKind::clusters;
  EXPECT_THROW(TransportWriter(folder / "a.hlt", small.info, {small.thresholds, "test", false}),
               Error);
  ClusterWeights first = weights;  // weights are found last
  std::fill(first.weight.begin(), first.weight.end(), std::int16_t{0});
  small.info.clusters = std::make_shared<const ClusterWeights>(first);
  EXPECT_EQ(small.info.output_count(), 20u);
  TransportWriter writer(folder / "a.hlt", small.info, {small.thresholds, "test", false});
  ASSERT_EQ(writer.tile_count(), 1);
  writer.write_tile(0, small.tiles[0]);
  FinishOptions options;
  ClusterWeights other = weights;
  other.first_vector = {0, 4, 6, 10, 10, 10};
  other.weight.resize(other.weight_begin().back());
  options.clusters = std::make_shared<const ClusterWeights>(other);
  EXPECT_THROW(writer.finish("{}", options), Error);
  options.clusters = std::make_shared<const ClusterWeights>(weights);
  options.measured_error = 0.125;
  EXPECT_EQ(writer.finish("{}", options).measured_error, 0.125);
  const Transport file = Transport::open(folder / "a.hlt");
  EXPECT_EQ(file.kind(), TransportKind::clusters);
  ASSERT_NE(file.info().clusters, nullptr);
  EXPECT_EQ(*file.info().clusters, weights);
  for (std::uint32_t o = 0; o < 20; ++o) EXPECT_EQ(file.row_output()[o], o);
  EXPECT_EQ(file.row_output()[20], kNoOutput);
  EXPECT_THROW(PictureRelighter{file}, Error);
}

// Files whose checksums are right and whose content is not.
class CraftedClusters : public testing::Test {
 protected:
  CraftedClusters() {
    auto small = fixtures::small_mesh_transport(2, fixtures::bumpy_sphere(100, 17), 17, 2);
    vertices_ = static_cast<std::uint32_t>(small.info.mesh->position.size());
    small.info.kind = TransportKind::clusters;
    small.info.view =
        std::make_shared<const ViewFactors>(fixtures::random_view_factors(vertices_, 2, 17));
    small.info.clusters = std::make_shared<const ClusterWeights>(some_weights(vertices_, 8, 2));
    TransportWriter writer(folder_ / "a.hlt", small.info, {small.thresholds, "test", false});
    small.tiles[0].color.assign(small.tiles[0].color.size(), Rgb{1, 1, 1});
    writer.write_tile(0, small.tiles[0]);
    writer.finish("{}");
    bytes_ = read_bytes(folder_ / "a.hlt");
    std::memcpy(&header_, bytes_.data(), sizeof header_);
  }
  std::string section(const FileSection& s) const { return bytes_.substr(s.offset, s.size); }
  // The file with `content` at its end, of which the header tells by `place`.
  std::string opened_with(const std::string& content, const auto& place) const {
    std::string bytes = bytes_;
    TransportHeader header = header_;
    const FileSection put{bytes.size(), content.size(),
                          XXH3_64bits(content.data(), content.size())};
    bytes += content;
    place(header, put, bytes);
    header.file_size = bytes.size();
    header.header_hash = XXH3_64bits(&header, offsetof(TransportHeader, header_hash));
    std::memcpy(bytes.data(), &header, sizeof header);
    write_bytes(folder_ / "b.hlt", bytes);
    try {
      const Transport file = Transport::open(folder_ / "b.hlt");
      return file.info().clusters && file.info().view ? "" : "opened without";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::format);
      return error.what();
    }
  }
  // Opened with this as the section of that name.
  std::string opened_with_section(const char* name, const std::string& content) const {
    return opened_with(
        content, [&](TransportHeader& header, const FileSection& put, std::string& bytes) {
          std::string table = section(header_.named);
          for (std::size_t at = 0; at < table.size(); at += sizeof(NamedSection)) {
            if (std::memcmp(table.data() + at, name, 8) == 0) {
              std::memcpy(table.data() + at + 8, &put, sizeof put);
            }
          }
          header.named = {bytes.size(), table.size(), XXH3_64bits(table.data(), table.size())};
          bytes += table;
        });
  }
  FileSection named(const char* name) const {
    const std::string table = section(header_.named);
    FileSection found;
    for (std::size_t at = 0; at < table.size(); at += sizeof(NamedSection)) {
      if (std::memcmp(table.data() + at, name, 8) == 0) {
        std::memcpy(&found, table.data() + at + 8, sizeof found);
      }
    }
    return found;
  }

  TemporaryFolder folder_;
  std::uint32_t vertices_ = 0;
  std::string bytes_;
  TransportHeader header_{};
};

TEST_F(CraftedClusters, CountsThatDoNotFitAreRefused) {
  for (const char* name : {kClustersName, kViewFactorsName}) {
    const std::string right = section(named(name));
    ASSERT_FALSE(right.empty());
    ASSERT_EQ(opened_with_section(name, right), "");
    const std::string called(name, strnlen(name, 8));
    const std::size_t counts = name == kClustersName ? 7 : 4;
    for (std::size_t word = 0; word < counts; ++word) {
      std::uint32_t value = 0;
      std::memcpy(&value, right.data() + 4 * word, 4);
      for (const std::uint32_t bad :
           {0u, 1u, value - 1, value + 1, 2 * value + 1, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
        if (bad == value) continue;
        std::string content = right;
        std::memcpy(content.data() + 4 * word, &bad, 4);
        EXPECT_NE(opened_with_section(name, content), "")
            << called << ", word " << word << ": " << bad << " in place of " << value;
      }
    }
    for (std::size_t size = 0; size < right.size(); size += 5) {
      EXPECT_NE(opened_with_section(name, right.substr(0, size)), "") << called << " " << size;
    }
  }
}

// Clusters find their vectors by the number of a row, and have colours at their vertices.
TEST_F(CraftedClusters, RowsAreInOrderAndWithoutColour) {
  const std::size_t rows = static_cast<std::size_t>(header_.chunk_count) * kChunkRows;
  const std::string packed = section(header_.rows);
  const RowTables right = unpack_tables(std::as_bytes(std::span(packed)), rows, 20, "a");
  const auto opened = [&](const RowTables& tables) {
    const std::vector<std::byte> bytes = pack_tables(tables);
    const std::string content(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    return opened_with(content, [](TransportHeader& header, const FileSection& put, std::string&) {
      header.rows = put;
    });
  };
  ASSERT_EQ(opened(right), "");
  RowTables swapped = right;
  std::swap(swapped.row_output[3], swapped.row_output[4]);
  EXPECT_NE(opened(swapped).find("row 3 of clusters"), std::string::npos) << opened(swapped);
  RowTables coloured = right;
  coloured.row_color[7].g *= 2;
  EXPECT_NE(opened(coloured).find("row 7 of clusters"), std::string::npos) << opened(coloured);
  RowTables later = right;
  later.row_output[19] = kNoOutput, later.row_output[20] = 19;
  EXPECT_NE(opened(later).find("row 19 of clusters"), std::string::npos) << opened(later);
}

}  // namespace
}  // namespace haarlight
