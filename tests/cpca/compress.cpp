// From a transport of vertices to a file of clusters.

#include "cpca/compress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/prior_lighting.h"
#include "tests/cpca/inputs.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;

Transport build(const SmallTransport& small) {
  return build_transport(small.info, small.tiles, small.thresholds);
}

std::vector<Rgb> grey(const std::vector<float>& light) {
  std::vector<Rgb> out;
  for (const float x : light) out.push_back({x, x, x});
  return out;
}

// U as a file of clusters has it, by a dense product.
std::vector<RgbD> shown_by(const Transport& transport, const std::vector<Rgb>& light) {
  return fixtures::combined(transport.info(),
                            fixtures::product(fixtures::dense_rows(transport), light));
}

TEST(Compress, MeasuredErrorIsWhatTheFileShows) {
  const TemporaryFolder folder;
  for (const bool tints : {false, true}) {
    const Transport transport = build(fixtures::smooth_transport(8, 400, 2, tints));
    const CompressReport report =
        compress_transport(transport, folder / "a.hlt", {.clusters = 8, .basis = 6});
    const Transport file = Transport::open(folder / "a.hlt");
    EXPECT_EQ(file.kind(), TransportKind::clusters);
    EXPECT_EQ(file.info().clusters->clusters(), report.clusters);
    EXPECT_EQ(file.info().clusters->tint.empty(), !tints);
    const std::vector<double> dense = fixtures::dense_rows(transport);
    double worst = 0;
    const auto& lightings = prior_lightings(transport.layout());
    for (std::size_t l = 0; l < lightings.size(); ++l) {
      const auto light = grey(lightings[l]);
      const double error =
          fixtures::relative_difference(shown_by(file, light), fixtures::product(dense, light));
      // Tints are rounded to 2^-16, sums are compared in float: both far below a thousandth of it.
      EXPECT_NEAR(report.of_lightings[l], error, 1e-3 * error + 1e-5);
      worst = std::max(worst, error);
    }
    EXPECT_NEAR(report.measured_error, worst, 1e-3 * worst + 1e-5);
    const auto meta = nlohmann::json::parse(file.info().meta);
    EXPECT_EQ(meta.at("measured_error").get<double>(), report.measured_error);
    EXPECT_EQ(meta.at("compressed").at("clusters").get<int>(), report.clusters);
    EXPECT_LT(report.measured_error, 0.1);
    EXPECT_TRUE(std::equal(file.column_norms().begin(), file.column_norms().end(),
                           transport.column_norms().begin(), transport.column_norms().end()));
  }
}

TEST(Compress, AsManyVectorsAsVerticesShowTheTransport) {
  // Rows without any likeness, in three channels and in one: clusters hold everything only if their
  // vectors span all of it. What is left is rounding to 8 bits in vectors, each entry by at most
  // half a 127th of the largest of its block, and the error aimed at.
  const TemporaryFolder folder;
  const Transport transport =
      build(fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(150, 4), 4, 2));
  const CompressReport report = compress_transport(transport, folder / "a.hlt",
                                                   {.clusters = 30, .basis = 256, .error = 1e-4});
  EXPECT_LT(report.measured_error, 0.02);
  const Transport file = Transport::open(folder / "a.hlt");
  std::mt19937_64 random(1);
  const auto light = fixtures::random_lighting(transport.layout(), random);
  EXPECT_LT(fixtures::relative_difference(
                shown_by(file, light), fixtures::product(fixtures::dense_rows(transport), light)),
            0.02);
}

TEST(Compress, ReachesTheErrorThatIsAimedAt) {
  const TemporaryFolder folder;
  const Transport transport = build(fixtures::smooth_transport(8, 900, 2, true));
  std::uint32_t before = 0;
  for (const double error : {0.2, 0.05, 0.015}) {
    const CompressReport report =
        compress_transport(transport, folder / "a.hlt", {.clusters = 12, .error = error});
    EXPECT_LE(report.measured_error, error);
    EXPECT_GT(report.measured_error, 0.4 * error);
    EXPECT_GT(report.vectors, before);  // and no more is spent than it takes
    before = report.vectors;
  }
}

// Rounding to 8 bits is in no estimate: the first file is not good enough, and is written anew.
TEST(Compress, WritesAgainUntilTheErrorIsKept) {
  const TemporaryFolder folder;
  const Transport transport = build(fixtures::smooth_transport(8, 1500, 1, false));
  const CompressReport report =
      compress_transport(transport, folder / "a.hlt", {.clusters = 12, .error = 0.007});
  EXPECT_LT(report.basis_error, 0.004);
  EXPECT_LE(report.measured_error, 0.007);
}

// Where clusters are ours to choose, the file is about as small as the best number tried makes it,
// and as right as asked for.
TEST(Compress, ChoosesClustersByTheFilesSize) {
  const TemporaryFolder folder;
  for (const double error : {0.1, 0.02}) {
    const Transport transport = build(error > 0.05 ? fixtures::smooth_transport(8, 600, 2, true)
                                                   : fixtures::smooth_transport(4, 700, 1, false));
    const auto vertices = static_cast<int>(transport.info().mesh->position.size());
    {
      const auto made = [&](int clusters) {
        return compress_transport(transport, folder / "a.hlt",
                                  {.clusters = clusters, .error = error});
      };
      std::uint64_t least = ~std::uint64_t{0};
      for (const int size : {50, 100, 200, 400}) {
        least = std::min(least, made(std::max(1, vertices / size)).bytes);
      }
      const CompressReport chosen = made(0);
      EXPECT_LE(chosen.measured_error, error);
      EXPECT_LE(static_cast<double>(chosen.bytes), 1.12 * static_cast<double>(least));
    }
  }
}

TEST(Compress, MoreVectorsAndMoreClustersLeaveLess) {
  const TemporaryFolder folder;
  const Transport transport = build(fixtures::smooth_transport(8, 600, 1, false));
  const auto error = [&](int clusters, int basis) {
    return compress_transport(transport, folder / "a.hlt",
                              {.clusters = clusters, .basis = basis, .error = 1e-3})
        .measured_error;
  };
  EXPECT_LT(error(6, 4), 0.8 * error(6, 2));
  EXPECT_LT(error(24, 2), 0.8 * error(6, 2));
}

TEST(Compress, BlackVerticesHaveNoVectors) {
  const TemporaryFolder folder;
  const Transport transport = build(fixtures::smooth_transport(4, 300, 2, false, 0.1));
  compress_transport(transport, folder / "a.hlt", {.clusters = 5, .basis = 4});
  const Transport file = Transport::open(folder / "a.hlt");
  const ClusterWeights& w = *file.info().clusters;
  const auto last = static_cast<std::size_t>(w.clusters()) - 1;
  EXPECT_EQ(w.vectors_of(last), 0u);
  std::size_t black = 0;
  for (const auto& n : transport.info().mesh->normal) black += static_cast<double>(n[1]) < 0.1;
  EXPECT_EQ(w.vertices_of(last), black);

  // A mesh that is black all over is a file all the same.
  const Transport night = build(fixtures::smooth_transport(4, 100, 1, false, 2));
  const CompressReport report = compress_transport(night, folder / "b.hlt", {});
  EXPECT_EQ(report.measured_error, 0);
  EXPECT_EQ(Transport::open(folder / "b.hlt").kind(), TransportKind::clusters);
}

TEST(Compress, SameBytesOnAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const Transport transport =
      build(fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(700, 6), 6, 2));
  const CompressOptions options{.clusters = 11, .basis = 9};
  const int threads = thread_count();
  set_thread_count(1);
  compress_transport(transport, folder / "one.hlt", options);
  set_thread_count(7);
  compress_transport(transport, folder / "seven.hlt", options);
  set_thread_count(threads);
  EXPECT_EQ(read_bytes(folder / "one.hlt"), read_bytes(folder / "seven.hlt"));
}

TEST(Compress, NarrowWeightsTakeFewerBytesAndLittleMoreError) {
  const TemporaryFolder folder;
  const Transport transport = build(fixtures::smooth_transport(8, 600, 1, false));
  CompressOptions options{.clusters = 10, .basis = 8, .error = 1e-3};
  const CompressReport wide = compress_transport(transport, folder / "w.hlt", options);
  options.bits = 8;
  const CompressReport narrow = compress_transport(transport, folder / "n.hlt", options);
  EXPECT_LT(narrow.bytes, wide.bytes);
  // A weight of at most m (m^2 <= vertices of the cluster) is off by m / 254 at most.
  EXPECT_LT(narrow.measured_error, wide.measured_error + 0.03);
  EXPECT_GT(narrow.measured_error, wide.measured_error);
}

TEST(Compress, RefusesAndLeavesNothingBehind) {
  const TemporaryFolder folder;
  const Transport transport = build(fixtures::smooth_transport(4, 100, 1, false));
  const auto refused = [&](const Transport& t, const CompressOptions& options,
                           const Progress& progress, const char* words) {
    try {
      compress_transport(t, folder / "a.hlt", options, progress);
      FAIL() << words;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
    EXPECT_TRUE(folder.entries().empty());
  };
  refused(transport, {.clusters = 1000}, {}, "clusters is 1000");
  refused(transport, {.clusters = -1}, {}, "clusters is -1");
  refused(transport, {.basis = 257}, {}, "basis is 257");
  refused(transport, {.error = 0}, {}, "error is 0");
  refused(transport, {.bits = 12}, {}, "bits is 12");
  refused(build(fixtures::small_transport(4, 8, 8, 1)), {}, {}, "of one view");
  for (const double at : {0.1, 0.35, 0.6, 0.97}) {
    refused(
        transport, {.clusters = 4, .basis = 3}, [at](double share) { return share < at; },
        "stopped");
  }
  compress_transport(transport, folder / "a.hlt", {.clusters = 4, .basis = 3});
  const Transport file = Transport::open(folder / "a.hlt");
  EXPECT_THROW(compress_transport(file, folder / "b.hlt", {}), Error);
  EXPECT_EQ(folder.entries().size(), 1u);
}

}  // namespace
}  // namespace haarlight
