// Estimates and bounds of the error of pictures that are made of terms and clusters.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "cpca/cluster_relighter.h"
#include "cpca/compress.h"
#include "prt/finish_rows.h"
#include "prt/frame_relighter.h"
#include "prt/picture_sum.h"
#include "prt/term_norms.h"
#include "prt/view_error_estimator.h"
#include "tests/cpca/inputs.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;

constexpr int kFace = 8, kTerms = 3;

class ViewErrors : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    // Vertices so near each other that a pixel, a mean of some, errs nearly as they do.
    SmallTransport small = fixtures::smooth_transport(kFace, 1500, kTerms, true, -0.9);
    const SmallTransport colored =
        fixtures::small_mesh_transport(kFace, fixtures::bumpy_sphere(1500, 5), 5, kTerms);
    for (std::size_t t = 0; t < small.tiles.size(); t += 9) small.tiles[t] = colored.tiles[t];
    // One material a half: vertices of a pixel are of one.
    ViewFactors factors =
        fixtures::random_view_factors(small.info.mesh->position.size(), kTerms, 8);
    for (std::size_t v = 0; v < factors.set_of.size(); ++v) {
      factors.set_of[v] = small.info.mesh->normal[v][0] > 0 ? 0 : 1;
    }
    small.info.view = std::make_shared<const ViewFactors>(factors);
    terms_ = new Transport(build_transport(small.info, small.tiles, small.thresholds));
    compress_transport(*terms_, *folder_ / "c.hlt", {.clusters = 9, .basis = 12});
    clusters_ = new Transport(Transport::open(*folder_ / "c.hlt"));
  }
  static void TearDownTestSuite() {
    delete terms_;
    delete clusters_;
    delete folder_;
  }
  static std::vector<std::vector<Rgb>> lights(int frames) {
    std::mt19937_64 random(5);
    const HaarLayout layout(kFace);
    std::vector<std::vector<Rgb>> out{fixtures::random_lighting(layout, random)};
    for (int f = 1; f < frames; ++f) {
      const std::vector<Rgb> step = fixtures::random_lighting(layout, random);
      std::vector<Rgb> light = out.back();
      for (std::size_t j = 0; j < light.size(); ++j) light[j] = light[j] + 0.1f * step[j];
      // A lamp that comes and goes; black once; the last five frames rest.
      if (f % 7 == 3) light[static_cast<std::size_t>(40 + f)] += Rgb{300, 200, 100};
      if (f == frames / 2) std::fill(light.begin(), light.end(), Rgb{});
      out.push_back(f < frames - 5 ? light : out.back());
    }
    return out;
  }
  static inline TemporaryFolder* folder_ = nullptr;
  static inline Transport* terms_ = nullptr;
  static inline Transport* clusters_ = nullptr;
};

// Against slow products: rows picked from all over, one of three channels among them, and sums of
// neighbours. Sums of 384 products in float: 400 x 2^-24 of what they would be without signs.
TEST_F(ViewErrors, SampledRowsAreThoseOfTheTransport) {
  const std::vector<double> dense = fixtures::dense_rows(*terms_);
  const auto size = static_cast<std::size_t>(terms_->layout().size());
  const auto rows = static_cast<std::size_t>(terms_->rows());
  std::vector<RowSum> sums;
  for (std::size_t row = 0; row + 3 < rows; row += 37) {
    if (terms_->row_output()[row] == kNoOutput) continue;
    sums.push_back({static_cast<std::uint32_t>(row), {1.0f}, {1, 0.5f, 0.25f}});
    if (terms_->row_output()[row + 1] == kNoOutput || terms_->row_output()[row + 2] == kNoOutput) {
      continue;
    }
    sums.push_back({static_cast<std::uint32_t>(row), {0.5f, -2.0f, 1.0f}, {1, 1, 1}});
  }
  SampleRows sampled(*terms_, sums);
  std::mt19937_64 random(3);
  const auto target = fixtures::random_lighting(terms_->layout(), random);
  auto shown = fixtures::random_lighting(terms_->layout(), random);
  // The slow rows, over their colours.
  const auto entry = [&](std::size_t row, std::size_t ch, std::size_t j) {
    const Rgb c = terms_->row_color()[row];
    const float of[3] = {c.r, c.g, c.b};
    return of[ch] == 0 ? 0.0
                       : dense[(3 * terms_->row_output()[row] + ch) * size + j] /
                             static_cast<double>(of[ch]);
  };
  const auto expect = [&](const std::vector<RgbD>& got, const auto& light) {
    ASSERT_EQ(got.size(), sums.size());
    for (std::size_t s = 0; s < sums.size(); ++s) {
      const float color[3] = {sums[s].color.r, sums[s].color.g, sums[s].color.b};
      const double out[3] = {got[s].r, got[s].g, got[s].b};
      for (std::size_t ch = 0; ch < 3; ++ch) {
        bool dark = false;
        for (std::size_t i = 0; i < sums[s].weight.size(); ++i) {
          const Rgb own = terms_->row_color()[sums[s].first_row + i];
          dark |= (ch == 0 ? own.r : ch == 1 ? own.g : own.b) == 0;
        }
        if (dark) continue;  // nothing to be found over its colour
        double right = 0, magnitude = 0;
        for (std::size_t i = 0; i < sums[s].weight.size(); ++i) {
          for (std::size_t j = 0; j < size; ++j) {
            const double x = static_cast<double>(color[ch] * sums[s].weight[i]) *
                             entry(sums[s].first_row + i, ch, j) * light(j, ch);
            right += x, magnitude += std::abs(x);
          }
        }
        ASSERT_NEAR(out[ch], right, 400 * 0x1p-24 * magnitude + 1e-12) << s << " " << ch;
      }
    }
  };
  const auto of = [](const Rgb& c, std::size_t ch) {
    return static_cast<double>(ch == 0 ? c.r : ch == 1 ? c.g : c.b);
  };
  std::vector<RgbD> change, light;
  sampled.multiply(target, shown, change, light);
  expect(light, [&](std::size_t j, std::size_t ch) { return of(target[j], ch); });
  expect(change,
         [&](std::size_t j, std::size_t ch) { return of(target[j], ch) - of(shown[j], ch); });
  for (int j = 0; j < 100; ++j) {
    const auto k = static_cast<std::size_t>(j);
    sampled.take_away(j, target[k] - shown[k], change);
    shown[k] = target[k];
  }
  std::vector<RgbD> again;
  sampled.multiply(target, shown, again, light);
  double apart = 0, most = 0;
  for (std::size_t s = 0; s < sums.size(); ++s) {
    apart = std::max(apart, l1_norm(change[s] - again[s]));
    most = std::max(most, l1_norm(light[s]));
  }
  EXPECT_LT(apart, 1e-5 * most);
}

// Against dense rows: never too small, too large by the 2e-6 that are added to be sure, twice over.
TEST_F(ViewErrors, NormsOfClassesAreThoseOfTheirRows) {
  const std::vector<double> dense = fixtures::dense_rows(*terms_);
  const auto size = static_cast<std::size_t>(terms_->layout().size());
  const auto rows = static_cast<std::size_t>(terms_->rows());
  constexpr std::size_t kClasses = 5;
  std::vector<std::uint32_t> class_of(rows, kNoOutput);
  std::vector<float> weight(rows, 0.0f);
  std::vector<double> squares(size * kClasses * 3);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::uint32_t output = terms_->row_output()[row];
    if (output == kNoOutput || row % 13 == 0) continue;
    class_of[row] = static_cast<std::uint32_t>(row / 40 % kClasses);  // some blocks are of two
    weight[row] = 1 + static_cast<float>(row % 3);
    for (std::size_t j = 0; j < size; ++j) {
      for (std::size_t ch = 0; ch < 3; ++ch) {
        const double t = dense[(3 * output + ch) * size + j];
        squares[(j * kClasses + class_of[row]) * 3 + ch] +=
            static_cast<double>(weight[row]) * t * t;
      }
    }
  }
  const TermNorms norms(*terms_, class_of, weight, kClasses);
  ASSERT_EQ(norms.norm.size(), squares.size());
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const double norm = static_cast<double>(norms.norm[i]), right = std::sqrt(squares[i]);
    ASSERT_GE(norm, right) << i;
    ASSERT_LE(norm, right * (1 + 1e-5)) << i;
  }
}

TEST_F(ViewErrors, BoundsHoldInEveryFrameAndEstimatesAreNear) {
  const int before = thread_count();
  set_thread_count(1);
  const auto light = lights(28);
  for (const Transport* transport : {terms_, clusters_}) {
    int frames = 0, near = 0, finite = 0, pending = 0;
    for (const LightingMethod method : {LightingMethod::nwa, LightingMethod::pbi}) {
      LightingOptions options;
      options.method = method;
      options.wavelets = 90;
      FrameRelighter relighter(*transport, options, WaveletWeight::transport,
                               any_relighter({.basis_terms = 2}));
      relighter.compare_with_reference(true);
      relighter.judge_errors(true);
      for (std::size_t f = 0; f < light.size(); ++f) {
        // Half of the frames from the first view, half from others.
        const Vec3 eyes[] = {{0, 0, 3.2}, {3.2, 0, 0}, {0, -3.2, 0.1}, {-1.4, 0.2, 1}};
        relighter.set_camera(look_at(eyes[f / 2 % 2 == 0 ? 0 : f % 4], {}, 0.6, 60, 50));
        const FrameMetrics& m = relighter.relight(
            light[f], f == 0 ? FrameStart::exact : FrameStart::advance, static_cast<int>(f));
        ASSERT_TRUE(m.error_estimate && m.error_bound);
        EXPECT_GE(*m.error_bound, *m.image_rel_rmse) << "frame " << f;
        finite += std::isfinite(*m.error_bound);
        pending += !relighter.settled();
        if (*m.image_rel_rmse > 1e-5 && std::isfinite(*m.image_rel_rmse)) {
          ++frames;
          const double ratio = *m.error_estimate / *m.image_rel_rmse;
          near += ratio < 1.5 && ratio > 1 / 1.5;
        }
      }
    }
    EXPECT_GT(frames, 30);
    EXPECT_GE(near, 0.9 * frames) << "of " << frames;
    EXPECT_EQ(finite, 2 * std::ssize(light));  // black light is shown at once
    EXPECT_EQ(pending > 10, transport == clusters_);
  }
  set_thread_count(before);
}

// A ground of four vertices fills half of the picture and has nearly all of the area. It may take
// four of the samples, so that the rest tells of the body on it, from behind as well.
TEST(ViewErrorSamples, LargeSurfacesOfFewVerticesLeaveOthersTheirs) {
  TransportMesh mesh = fixtures::bumpy_sphere(2500, 5);
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (const auto& [x, z] : {std::pair{-9.0f, -9.0f}, {-9.0f, 9.0f}, {9.0f, 9.0f}, {9.0f, -9.0f}}) {
    mesh.position.push_back({x, -1.2f, z});
    mesh.normal.push_back({0, 1, 0});
  }
  mesh.triangle.push_back({first, first + 1, first + 2});
  mesh.triangle.push_back({first, first + 2, first + 3});
  SmallTransport small = fixtures::smooth_transport(kFace, mesh, kTerms, false);
  ViewFactors factors = fixtures::random_view_factors(small.info.mesh->position.size(), kTerms, 8);
  // The ground is dark and alike from everywhere: set 2.
  for (std::size_t v = 0; v < factors.set_of.size(); ++v) factors.set_of[v] = v < first ? 0 : 2;
  const std::size_t of_set = factors.profile.size() / 3;
  for (std::size_t i = 2 * of_set; i < factors.profile.size(); ++i) {
    factors.profile[i] = 0.1f * factors.profile[i];
  }
  small.info.view = std::make_shared<const ViewFactors>(factors);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  std::mt19937_64 random(5);
  std::vector<Rgb> light = fixtures::random_lighting(transport.layout(), random);
  LightingOptions options;
  options.method = LightingMethod::nwa;
  options.wavelets = 90;
  FrameRelighter relighter(transport, options, WaveletWeight::transport);
  relighter.compare_with_reference(true);
  relighter.judge_errors(true);
  const Vec3 middle = small.info.mesh->origin;
  constexpr int kFrames = 40;
  int near = 0;
  for (int f = 0; f < kFrames; ++f) {
    const double turn = 2 * kPi * f / kFrames;
    relighter.set_camera(
        look_at(middle + Vec3{4 * std::sin(turn), 1.5, 4 * std::cos(turn)}, middle, 0.6, 60, 50));
    light[static_cast<std::size_t>(40 + f)] += Rgb{30, 20, 10};
    const FrameMetrics& m =
        relighter.relight(light, f == 0 ? FrameStart::dark : FrameStart::advance, f);
    const double ratio = *m.error_estimate / *m.image_rel_rmse;
    near += ratio < 1.25 && ratio > 1 / 1.25;
  }
  EXPECT_GE(near, 0.9 * kFrames);
}

// What the pixels add up to, against pixels that were drawn; and it is no more than their norm,
// however small the light is beside others.
TEST_F(ViewErrors, TheSumOfAPictureIsKnownWithoutDrawingIt) {
  for (const Transport* transport : {terms_, clusters_}) {
    const std::unique_ptr<Relighter> relighter = make_relighter(any_relighter(), *transport);
    PictureSum sum(*transport);
    const auto light = lights(6);
    for (std::size_t f = 0; f < light.size(); ++f) {
      const Vec3 sides[] = {{0, 0, 3}, {2.5, -1, 1}, {-1, 0.2, 1.2}};
      const BoundingSphere sphere = bounding_sphere(*transport->info().mesh);
      relighter->set_camera(
          look_at(sphere.center + sphere.radius * sides[f % 3], sphere.center, 0.6, 60, 50));
      relighter->set_exact(true);
      LightingUpdate update = full_update(transport->layout(), light[f]);
      for (int b = 0; b < transport->layout().band_count(); ++b) {
        update.reset[static_cast<std::size_t>(b)] = true;
      }
      relighter->apply(update);
      std::vector<float> weights;
      relighter->vertex_weights(weights);
      sum.look({weights, relighter->view_factors()});
      RgbD total;
      double covered = 0, squares = 0;
      for (std::size_t p = 0; p < relighter->picture().pixels.size(); ++p) {
        const auto c = static_cast<double>(relighter->coverage()[p]);
        const RgbD pixel(relighter->picture().pixels[p]);
        total += c * pixel;
        squares += pixel.r * pixel.r + pixel.g * pixel.g + pixel.b * pixel.b;
        covered += c * c;
      }
      const double right =
          std::sqrt((total.r * total.r + total.g * total.g + total.b * total.b) / covered);
      // Pixels are floats that may cancel: 1e-5 of their norm.
      EXPECT_NEAR(sum.least_norm(light[f]), right, 1e-5 * std::sqrt(squares)) << f;
      EXPECT_GT(right, 1e-3 * std::sqrt(squares)) << f;
      EXPECT_LE(right, std::sqrt(squares)) << f;
    }
  }
}

// The light is right at once, and vertices follow it one vector a frame: all error is what they
// have yet to follow.
TEST_F(ViewErrors, WhatVerticesHaveYetToFollowIsKnown) {
  LightingOptions options;
  options.method = LightingMethod::reference;
  ClusterRelighter apart(*clusters_, {.basis_terms = 1, .skip_unseen = false});
  ViewErrorEstimator estimator(*clusters_);
  const auto light = lights(10);
  LightingTracker tracker(clusters_->layout(), options);
  ClusterRelighter exact(*clusters_, {.basis_terms = -1, .skip_unseen = false});
  exact.apply(full_update(clusters_->layout(), light[0]));
  apart.apply(tracker.advance(light[0]));
  std::vector<float> weights;
  std::vector<double> pending;
  apart.vertex_weights(weights);
  estimator.look({weights, apart.view_factors()});
  double last = 1e30;
  for (int frame = 0; frame < 6; ++frame) {
    apart.pending_rows(pending);
    ASSERT_FALSE(pending.empty());
    estimator.set_pending(pending);
    double norm = 0, difference = 0, of_exact = 0;
    for (std::size_t i = 0; i < apart.picture().pixels.size(); ++i) {
      const RgbD p(apart.picture().pixels[i]), r(exact.picture().pixels[i]), d = p - r;
      norm += p.r * p.r + p.g * p.g + p.b * p.b;
      of_exact += r.r * r.r + r.g * r.g + r.b * r.b;
      difference += d.r * d.r + d.g * d.g + d.b * d.b;
    }
    const double error = std::sqrt(difference / of_exact);
    const PictureErrorGuess guess = estimator.judge(light[0], tracker.shown(), std::sqrt(norm));
    EXPECT_GE(guess.bound, error);
    EXPECT_LT(guess.estimate, 1.5 * error);
    EXPECT_GT(guess.estimate, error / 1.5);
    EXPECT_LT(guess.estimate, last * 1.5);
    last = guess.estimate;
    apart.apply(tracker.advance(light[0]));
  }
}

TEST_F(ViewErrors, BudgetsByErrorAreKept) {
  const auto light = lights(14);
  for (const Transport* transport : {terms_, clusters_}) {
    int updates[2] = {};
    for (int which = 0; which < 2; ++which) {
      const double wanted = which == 0 ? 0.2 : 0.05;
      FrameRelighter relighter(*transport, {}, WaveletWeight::transport, any_relighter());
      relighter.set_budget({BudgetKind::error, wanted});
      for (std::size_t f = 0; f < light.size(); ++f) {
        relighter.set_camera(look_at({f % 3 == 1 ? 3.2 : 0, 0, 3.2}, {}, 0.6, 24, 20));
        const FrameMetrics& m = relighter.relight(
            light[f], f == 0 ? FrameStart::exact : FrameStart::advance, static_cast<int>(f));
        ASSERT_TRUE(m.error_estimate);
        EXPECT_LE(*m.error_estimate, wanted * (1 + 1e-4)) << f;
        EXPECT_TRUE(relighter.settled());
        if (f > 0) updates[which] += m.updates;
      }
    }
    EXPECT_GT(updates[1], updates[0]);
    EXPECT_LT(updates[1], 13 * 384);
  }
}

TEST_F(ViewErrors, TheSameBitsOnAnyNumberOfThreads) {
  const int before = thread_count();
  const auto light = lights(12);
  for (const Transport* transport : {terms_, clusters_}) {
    PictureErrorGuess guess[2];
    for (int run = 0; run < 2; ++run) {
      set_thread_count(run == 0 ? 1 : 5);
      ViewErrorEstimator estimator(*transport);
      const std::vector<float> weights(transport->info().mesh->position.size(), 1.0f);
      estimator.look({weights, {}});
      guess[run] = estimator.judge(light[1], light[0], 1e6);
    }
    EXPECT_EQ(guess[0].estimate, guess[1].estimate);
    EXPECT_EQ(guess[0].bound, guess[1].bound);
    EXPECT_GT(guess[0].estimate, 0);
  }
  set_thread_count(before);
}

}  // namespace
}  // namespace haarlight
