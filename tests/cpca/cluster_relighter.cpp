// Relighting from clusters: U = W M shown, however it was come by.

#include "cpca/cluster_relighter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/image_metrics.h"
#include "core/parallel.h"
#include "cpca/compress.h"
#include "prt/frame_relighter.h"
#include "prt/lighting_tracker.h"
#include "prt/prior_lighting.h"
#include "tests/cpca/inputs.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;

LightingOptions options_of(LightingMethod method, int wavelets) {
  LightingOptions options;
  options.method = method;
  options.wavelets = wavelets;
  return options;
}

// Clusters of rows of three channels and of one, tints, black vertices.
class ClusterRelighting : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    SmallTransport small = fixtures::smooth_transport(4, 500, 3, true, -0.6);
    // Some blocks of three channels among them.
    const SmallTransport colored =
        fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(500, 5), 5, 3);
    for (std::size_t t = 0; t < small.tiles.size(); t += 5) small.tiles[t] = colored.tiles[t];
    small.info.view = std::make_shared<const ViewFactors>(
        fixtures::random_view_factors(small.info.mesh->position.size(), 3, 8));
    const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
    compress_transport(transport, *folder_ / "c.hlt", {.clusters = 12, .basis = 12});
  }
  static void TearDownTestSuite() { delete folder_; }

  Transport transport_ = Transport::open(*folder_ / "c.hlt");
  std::vector<double> dense_ = fixtures::dense_rows(transport_);

  std::vector<RgbD> right(std::span<const Rgb> shown) const {
    return fixtures::combined(transport_.info(), fixtures::product(dense_, shown));
  }
  // The sizes that sums are made of: sum |w| |M| |shown|, for bounds.
  double size_of(std::span<const Rgb> shown) const {
    std::vector<double> sizes = dense_;
    for (double& x : sizes) x = std::abs(x);
    std::vector<Rgb> light(shown.begin(), shown.end());
    for (Rgb& l : light) l = {std::abs(l.r), std::abs(l.g), std::abs(l.b)};
    double most = 0;
    for (const RgbD& p : fixtures::product(sizes, light)) most = std::max(most, l1_norm(p));
    // Weights are at most sqrt(vertices of a cluster); vectors of a cluster at most 12.
    return most * 12 * std::sqrt(static_cast<double>(transport_.info().mesh->position.size()));
  }
  void expect_right(const ClusterRelighter& relighter, std::span<const Rgb> shown,
                    double updates) const {
    const auto expected = right(shown);
    // Bound A of docs/method.md twice, for the sums of vectors and of vertices, then two roundings
    // to float.
    const double bound = 2 * (updates + 2 * 96) * 0x1p-53 * size_of(shown);
    for (std::size_t o = 0; o < expected.size(); ++o) {
      const RgbD u(relighter.sums()[o]);
      ASSERT_NEAR(u.r, expected[o].r, bound + 0x1p-22 * std::abs(expected[o].r)) << o;
      ASSERT_NEAR(u.g, expected[o].g, bound + 0x1p-22 * std::abs(expected[o].g)) << o;
      ASSERT_NEAR(u.b, expected[o].b, bound + 0x1p-22 * std::abs(expected[o].b)) << o;
    }
  }
  static TemporaryFolder* folder_;
};
TemporaryFolder* ClusterRelighting::folder_ = nullptr;

TEST_F(ClusterRelighting, WithAllTermsSumsAreTheProductAfterEveryFrame) {
  const HaarLayout& layout = transport_.layout();
  for (const auto method : {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
    std::mt19937_64 random(2);
    LightingTracker tracker(layout, options_of(method, 25));
    ClusterRelighter relighter(transport_, {.basis_terms = -1, .skip_unseen = false});
    for (int frame = 0; frame < 12; ++frame) {
      auto target = fixtures::random_lighting(layout, random);
      if (frame == 5) target[3] = {1e6f, 1e6f, 1e6f};  // a sun, for one frame
      if (frame == 8) target.assign(target.size(), Rgb{});
      relighter.apply(frame == 0 ? tracker.start_exact(target) : tracker.advance(target));
      // The sun may stay shown under bi; bounds are of the largest light met.
      std::vector<Rgb> shown(tracker.shown().begin(), tracker.shown().end());
      const auto expected = right(shown);
      std::vector<Rgb> met = shown;
      if (frame >= 5) met[3] = {1e6f, 1e6f, 1e6f};
      const double bound = 2 * (25.0 * (frame + 1) + 192) * 0x1p-53 * size_of(met);
      for (std::size_t o = 0; o < expected.size(); ++o) {
        const RgbD u(relighter.sums()[o]);
        ASSERT_NEAR(u.r, expected[o].r, bound + 0x1p-22 * std::abs(expected[o].r));
        ASSERT_NEAR(u.b, expected[o].b, bound + 0x1p-22 * std::abs(expected[o].b));
      }
    }
  }
}

TEST_F(ClusterRelighting, AFewTermsAFrameArriveAtTheProductAndThenRest) {
  const HaarLayout& layout = transport_.layout();
  std::mt19937_64 random(3);
  for (const int terms : {1, 0, 7}) {
    LightingTracker tracker(layout, options_of(LightingMethod::pbi, 20));
    ClusterRelighter relighter(transport_, {.basis_terms = terms, .skip_unseen = false});
    std::vector<Rgb> target;
    int frame = 0;
    for (; frame < 10; ++frame) {
      target = fixtures::random_lighting(layout, random);
      relighter.apply(tracker.advance(target));
      // No more entries than allowed, in any cluster and term.
      const int most = terms == 0 ? 3 : terms;
      EXPECT_LE(relighter.combine_stats().changes,
                most * 3 * transport_.info().clusters->clusters());
    }
    EXPECT_FALSE(relighter.settled());
    const double before = fixtures::relative_difference(right(tracker.shown()), right(target));
    // The light rests: it is shown after 96 / 20 frames, and vertices follow in at most as many
    // frames as the vectors take, and two in which roundings are handed out.
    for (int rest = 0; rest < 5 + 12 / (terms == 0 ? 3 : terms) + 3; ++rest) {
      relighter.apply(tracker.advance(target));
    }
    EXPECT_TRUE(relighter.settled()) << terms;
    EXPECT_GT(before, 0);
    expect_right(relighter, target, 20 * 20);
    const std::vector<Rgb> reached(relighter.sums().begin(), relighter.sums().end());
    const RelightStats stats = relighter.apply(tracker.advance(target));
    EXPECT_EQ(stats.apply.transport_bytes, 0u);
    EXPECT_EQ(relighter.combine_stats().changes, 0);
    EXPECT_TRUE(std::equal(reached.begin(), reached.end(), relighter.sums().begin()));
  }
}

TEST_F(ClusterRelighting, TheLargestChangesGoFirst) {
  // With one term a frame, the error that is left after each frame is that of all changes but the
  // largest ones: it falls as fast as any choice of one vector a cluster and term can make it.
  const HaarLayout& layout = transport_.layout();
  std::mt19937_64 random(4);
  const auto target = fixtures::random_lighting(layout, random);
  LightingTracker tracker(layout, options_of(LightingMethod::reference, 1));
  ClusterRelighter relighter(transport_, {.basis_terms = 1, .skip_unseen = false});
  relighter.apply(tracker.advance(target));
  const ClusterWeights& w = *transport_.info().clusters;
  const auto vectors = fixtures::product(dense_, target);
  std::vector<RgbD> largest(vectors.size());
  for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t first = w.first_vector[c] * 3 + k * w.vectors_of(c);
      std::size_t best = first;
      for (std::size_t i = first; i < first + w.vectors_of(c); ++i) {
        if (l1_norm(vectors[i]) > l1_norm(vectors[best])) best = i;
      }
      if (w.vectors_of(c) > 0) largest[best] = vectors[best];
    }
  }
  std::vector<RgbD> shown;
  for (const Rgb& u : relighter.sums()) shown.push_back(RgbD(u));
  EXPECT_LT(fixtures::relative_difference(shown, fixtures::combined(transport_.info(), largest)),
            1e-5);
}

TEST_F(ClusterRelighting, LightsOutIsExactlyBlackAndBlackVerticesAlwaysAre) {
  const HaarLayout& layout = transport_.layout();
  std::mt19937_64 random(5);
  LightingTracker tracker(layout, options_of(LightingMethod::bi, 40));
  ClusterRelighter relighter(transport_, {.basis_terms = 2, .skip_unseen = false});
  const ClusterWeights& w = *transport_.info().clusters;
  const auto positive_zero = [](const Rgb& u) {
    return u == Rgb{} && !std::signbit(u.r) && !std::signbit(u.g) && !std::signbit(u.b);
  };
  std::size_t black = 0;
  for (int frame = 0; frame < 20; ++frame) {
    relighter.apply(tracker.advance(fixtures::random_lighting(layout, random)));
    for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
      if (w.vectors_of(c) > 0) continue;
      for (std::uint32_t p = w.first_vertex[c]; p < w.first_vertex[c + 1]; ++p) {
        for (std::size_t k = 0; k < 3; ++k) {
          ++black;
          ASSERT_TRUE(positive_zero(relighter.sums()[w.vertex[p] * 3 + k]));
        }
      }
    }
  }
  EXPECT_GT(black, 0u);
  const std::vector<Rgb> nothing(static_cast<std::size_t>(layout.size()));
  for (int frame = 0; frame < 12; ++frame) relighter.apply(tracker.advance(nothing));
  EXPECT_TRUE(relighter.settled());
  for (const Rgb& u : relighter.sums()) ASSERT_TRUE(positive_zero(u));
}

TEST_F(ClusterRelighting, WhatWasOutOfViewIsUpToDateWhenItComesIntoIt) {
  const HaarLayout& layout = transport_.layout();
  const Camera front = transport_.info().camera;
  const BoundingSphere middle = bounding_sphere(*transport_.info().mesh);
  const Camera back = turned_about(front, middle.center, kPi);
  std::mt19937_64 random(6);
  LightingTracker tracker(layout, options_of(LightingMethod::pbi, 20));
  ClusterRelighter relighter(transport_, {.basis_terms = -1});
  ClusterRelighter all(transport_, {.basis_terms = -1, .skip_unseen = false});
  ClusterRelighter slow(transport_, {.basis_terms = 1});
  for (ClusterRelighter* r : {&relighter, &all, &slow}) r->set_camera(front);
  int fewer = 0;
  for (int frame = 0; frame < 50; ++frame) {
    const LightingUpdate update = tracker.advance(fixtures::random_lighting(layout, random));
    for (ClusterRelighter* r : {&relighter, &all, &slow}) r->apply(update);
    ASSERT_EQ(relighter.picture().pixels, all.picture().pixels) << frame;
    fewer += relighter.combine_stats().changes < all.combine_stats().changes;
  }
  EXPECT_EQ(fewer, 50);  // something is behind
  for (ClusterRelighter* r : {&relighter, &all, &slow}) {
    r->set_camera(back);
    r->apply({});
  }
  // Sums took other ways to the same product: bound A, against the largest radiance.
  double largest = 0, off = 0;
  for (std::size_t i = 0; i < all.picture().pixels.size(); ++i) {
    const RgbD a(all.picture().pixels[i]), b(relighter.picture().pixels[i]);
    largest = std::max(largest, l1_norm(a));
    off = std::max(off, l1_norm(a - b));
  }
  EXPECT_GT(largest, 0);
  EXPECT_LE(off, 1e-5 * largest);
  // Also with few terms a frame, clusters that were out of view come in exact.
  const auto expected = right(tracker.shown());
  std::size_t checked = 0;
  const ClusterWeights& w = *transport_.info().clusters;
  ClusterRelighter before(transport_, {});
  before.set_camera(front);
  before.apply({});
  for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
    if (!slow.seen()[c] || before.seen()[c]) continue;
    for (std::uint32_t p = w.first_vertex[c]; p < w.first_vertex[c + 1]; ++p) {
      const std::size_t o = w.vertex[p] * 3;
      ++checked;
      EXPECT_LE(l1_norm(RgbD(slow.sums()[o]) - expected[o]),
                1e-5 * size_of(tracker.shown()) * 0x1p-10 + 1e-5 * l1_norm(expected[o]));
    }
  }
  EXPECT_GT(checked, 0u);
}

TEST_F(ClusterRelighting, OnlyTheViewChangesAndNothingIsApplied) {
  const HaarLayout& layout = transport_.layout();
  std::mt19937_64 random(7);
  const auto target = fixtures::random_lighting(layout, random);
  FrameRelighter frames(transport_, options_of(LightingMethod::pbi, 30), WaveletWeight::area,
                        any_relighter({.basis_terms = 2}));
  frames.relight(target, FrameStart::exact, 0);
  EXPECT_TRUE(frames.settled());
  const BoundingSphere middle = bounding_sphere(*transport_.info().mesh);
  for (int i = 1; i <= 100; ++i) {
    const Camera camera = turned_about(transport_.info().camera, middle.center, 2 * kPi * i / 100);
    frames.set_camera(camera);
    const FrameMetrics& metrics = frames.relight(target, FrameStart::advance, i);
    EXPECT_EQ(metrics.updates, 0);
    if (i % 20 != 0) continue;
    const Image once = relight_picture_once(transport_, target, camera, any_relighter());
    EXPECT_LE(compare_images(frames.picture(), once).relative_rmse, 1e-6) << i;
  }
}

TEST_F(ClusterRelighting, ExactStartsDarkStartsAndReferencesAreExact) {
  const HaarLayout& layout = transport_.layout();
  std::mt19937_64 random(8);
  FrameRelighter frames(transport_, options_of(LightingMethod::pbi, 10), WaveletWeight::area,
                        any_relighter({.basis_terms = 1}));
  frames.compare_with_reference(true);
  frames.relight(fixtures::random_lighting(layout, random), FrameStart::exact, 0);
  EXPECT_TRUE(frames.settled());
  EXPECT_LE(*frames.relight(fixtures::random_lighting(layout, random), FrameStart::exact, 1)
                 .image_rel_rmse,
            1e-6);
  const auto target = fixtures::random_lighting(layout, random);
  EXPECT_GT(*frames.relight(target, FrameStart::advance, 2).image_rel_rmse, 1e-3);
  const std::vector<Rgb> nothing(static_cast<std::size_t>(layout.size()));
  frames.relight(nothing, FrameStart::dark, 3);
  for (const Rgb& p : frames.picture().pixels) ASSERT_EQ(p, Rgb{});
  frames.set_options(options_of(LightingMethod::reference, 1), WaveletWeight::area);
  EXPECT_LE(*frames.relight(target, FrameStart::advance, 4).image_rel_rmse, 1e-6);
}

TEST_F(ClusterRelighting, SameBitsOnAnyNumberOfThreads) {
  const HaarLayout& layout = transport_.layout();
  const int threads = thread_count();
  std::vector<Rgb> sums[2];
  std::vector<Rgb> pixels[2];
  for (int run = 0; run < 2; ++run) {
    set_thread_count(run == 0 ? 1 : 7);
    std::mt19937_64 random(9);
    LightingTracker tracker(layout, options_of(LightingMethod::pbi, 15));
    ClusterRelighter relighter(transport_, {.basis_terms = 2});
    for (int frame = 0; frame < 10; ++frame) {
      relighter.apply(tracker.advance(fixtures::random_lighting(layout, random)));
    }
    sums[run].assign(relighter.sums().begin(), relighter.sums().end());
    pixels[run] = relighter.picture().pixels;
  }
  set_thread_count(threads);
  EXPECT_EQ(sums[0], sums[1]);
  EXPECT_EQ(pixels[0], pixels[1]);
}

TEST_F(ClusterRelighting, RefusesWhatItIsNotFor) {
  const SmallTransport small = fixtures::smooth_transport(4, 90, 1, false);
  EXPECT_THROW(ClusterRelighter(build_transport(small.info, small.tiles, small.thresholds)), Error);
  EXPECT_THROW(ClusterRelighter(transport_, {.basis_terms = -2}), Error);
  EXPECT_THROW(FrameRelighter(transport_, {}, WaveletWeight::area), Error);
}

}  // namespace
}  // namespace haarlight
