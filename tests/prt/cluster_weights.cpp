// Weights of clustered PCA: packed, checked, kept in files.

#include "prt/cluster_weights.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "core/error.h"
#include "prt/picture_relighter.h"
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

}  // namespace
}  // namespace haarlight
