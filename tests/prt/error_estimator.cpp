// Estimates and bounds of the picture's error against the error itself; budgets by error.

#include "prt/error_estimator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/image_metrics.h"
#include "core/parallel.h"
#include "prt/frame_relighter.h"
#include "prt/image_relighter.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

constexpr int kFace = 8;

Transport random_picture() {
  const fixtures::SmallTransport small = fixtures::small_transport(kFace, 40, 24, 5);
  return build_transport(small.info, small.tiles, small.thresholds);
}

/// Rows as real ones are: what a sky of radiance 1 leaves of it, half in shadow.
Transport shadowed_picture() {
  fixtures::SmallTransport small = fixtures::small_transport(kFace, 40, 24, 6);
  std::mt19937_64 random(7);
  for (TileRows& tile : small.tiles) {
    if (!tile.values.empty()) tile = fixtures::unit_tile(HaarLayout(kFace), random);
  }
  return build_transport(small.info, small.tiles, small.thresholds);
}

Transport random_mesh() {
  const fixtures::SmallTransport small =
      fixtures::small_mesh_transport(kFace, fixtures::bumpy_sphere(900, 3), 8);
  return build_transport(small.info, small.tiles, small.thresholds);
}

/// A light that wanders, with a lamp that goes on and off.
std::vector<std::vector<Rgb>> wandering_light(int frames, std::uint64_t seed) {
  const HaarLayout layout(kFace);
  std::mt19937_64 random(seed);
  std::vector<Rgb> light = fixtures::random_lighting(layout, random);
  std::vector<std::vector<Rgb>> out;
  for (int f = 0; f < frames; ++f) {
    const std::vector<Rgb> step = fixtures::random_lighting(layout, random);
    for (std::size_t j = 0; j < light.size(); ++j) light[j] = light[j] + 0.1f * step[j];
    out.push_back(light);
    if (f % 7 > 3) out.back()[static_cast<std::size_t>(40 + f)] += Rgb{5000, 3000, 1000};
    if (f == frames / 2) std::fill(out.back().begin(), out.back().end(), Rgb{});
  }
  return out;
}

TEST(ErrorTables, NormsAndSumsAreThoseOfTheColumns) {
  const fixtures::SmallTransport small = fixtures::small_transport(kFace, 40, 24, 5);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const ErrorTables tables(transport);
  const std::vector<double> t = fixtures::dense(small);
  const std::size_t size = 6 * kFace * kFace;
  for (std::size_t j = 0; j < size; ++j) {
    for (std::size_t ch = 0; ch < 3; ++ch) {
      double squares = 0, sum = 0, magnitude = 0;
      for (std::size_t i = 0; i < small.info.output_count(); ++i) {
        const double v = t[(3 * i + ch) * size + j];
        squares += v * v, sum += v, magnitude += std::abs(v);
      }
      double norm2 = 0, total = 0;
      for (std::size_t g = 0; g < tables.groups; ++g) {
        const auto norm = static_cast<double>(tables.norm[(3 * j + ch) * tables.groups + g]);
        norm2 += norm * norm;
        total += static_cast<double>(tables.sum[(3 * j + ch) * tables.groups + g]);
      }
      // Never too small; too large by twice the 2e-5 that are added to be sure.
      EXPECT_GE(norm2, squares);
      EXPECT_LE(norm2, squares * (1 + 1e-4));
      EXPECT_NEAR(total, sum, 2e-5 * magnitude);
    }
  }
}

// Every column of T is a lighting of its own. Its sketched norm has a relative deviation of about
// 1 / sqrt(2 * 16 * 3) = 0.10 (a little less: rows of a block never meet); the mean over 384
// columns of independent entries is within 4 standard errors, 0.021, of the truth, with room for
// the square.
TEST(ErrorTables, SketchesKeepNorms) {
  const Transport transport = random_picture();
  const ErrorTables tables(transport);
  double mean = 0, spread = 0;
  const auto size = static_cast<std::size_t>(transport.layout().size());
  for (std::size_t j = 0; j < size; ++j) {
    double sketch2 = 0;
    for (std::size_t k = 0; k < tables.sketch_size(); ++k) {
      const auto s = static_cast<double>(tables.sketch[j * tables.sketch_size() + k]);
      sketch2 += s * s;
    }
    const auto norm = static_cast<double>(transport.column_norms()[j]);
    const double ratio = std::sqrt(sketch2) / norm;
    mean += ratio / static_cast<double>(size);
    spread += (ratio - 1) * (ratio - 1) / static_cast<double>(size);
  }
  EXPECT_NEAR(mean, 1, 0.03);
  EXPECT_LT(std::sqrt(spread), 0.13);
  EXPECT_GT(std::sqrt(spread), 0.04);
}

TEST(ErrorEstimator, BoundsHoldInEveryFrameAndEstimatesAreNear) {
  const int before = thread_count();
  set_thread_count(1);
  int frames = 0, near = 0;
  for (const Transport& transport : {random_picture(), shadowed_picture(), random_mesh()}) {
    for (const LightingMethod method :
         {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
      for (const FrameStart start : {FrameStart::exact, FrameStart::dark}) {
        LightingOptions options;
        options.method = method;
        options.wavelets = 60;
        FrameRelighter relighter(transport, options, WaveletWeight::transport);
        relighter.compare_with_reference(true);
        relighter.judge_errors(true);
        int frame = 0;
        for (const std::vector<Rgb>& target : wandering_light(24, 11)) {
          const FrameMetrics& m =
              relighter.relight(target, frame == 0 ? start : FrameStart::advance, frame);
          ASSERT_TRUE(m.error_estimate && m.error_bound);
          EXPECT_GE(*m.error_bound, *m.image_rel_rmse) << "frame " << frame;
          // Vertices here err each for itself, which no surface's do: pixels, means of them, err
          // less than estimated.
          const bool picture = transport.kind() == TransportKind::image;
          if (picture && *m.image_rel_rmse > 1e-6 && std::isfinite(*m.image_rel_rmse)) {
            ++frames;
            const double ratio = *m.error_estimate / *m.image_rel_rmse;
            near += ratio < 1.5 && ratio > 1 / 1.5;
          }
          ++frame;
        }
      }
    }
  }
  set_thread_count(before);
  EXPECT_GT(frames, 200);
  EXPECT_GE(near, 0.9 * frames) << "of " << frames;
}

// One coefficient left out: nothing for a triangle inequality to give away. The picture's norm is
// known but for that difference, so bound and error agree to its square and the 2e-5 of the norms.
TEST(ErrorEstimator, TheBoundOfOneCoefficientIsTight) {
  const Transport transport = shadowed_picture();
  ErrorEstimator estimator(transport);
  std::mt19937_64 random(3);
  std::vector<Rgb> target = fixtures::random_lighting(transport.layout(), random);
  for (const std::size_t j : {0u, 17u, 100u, 300u}) {
    std::vector<Rgb> shown = target;
    shown[j] += Rgb{2, -1, 0.5f};
    const Image picture = relight_once(transport, shown), exact = relight_once(transport, target);
    double norm = 0;
    for (const Rgb& p : picture.pixels) {
      const RgbD d(p);
      norm += d.r * d.r + d.g * d.g + d.b * d.b;
    }
    const double error = compare_images(picture, exact).relative_rmse;
    const PictureErrorGuess guess = estimator.judge(target, shown, std::sqrt(norm));
    EXPECT_GE(guess.bound, error);
    EXPECT_LE(guess.bound, error * (1 + 2 * error) * (1 + 1e-4) + 1e-6) << j;
  }
}

TEST(ErrorEstimator, StepByStepIsTheSameAsAtOnce) {
  const Transport transport = random_picture();
  ErrorEstimator one(transport), two(transport);
  std::mt19937_64 random(4);
  const std::vector<Rgb> target = fixtures::random_lighting(transport.layout(), random);
  std::vector<Rgb> shown = fixtures::random_lighting(transport.layout(), random);
  one.begin(target, shown);
  for (int index = 0; index < 200; ++index) {
    const auto j = static_cast<std::size_t>(index);
    one.take(index, target[j] - shown[j]);
    shown[j] = target[j];
  }
  two.begin(target, shown);
  EXPECT_GT(two.estimate(), 0);
  EXPECT_NEAR(one.estimate(), two.estimate(), 1e-5 * two.estimate());
}

TEST(ErrorEstimator, TheSameBitsOnAnyNumberOfThreads) {
  const int before = thread_count();
  const Transport transport = random_mesh();
  std::mt19937_64 random(4);
  const std::vector<Rgb> target = fixtures::random_lighting(transport.layout(), random);
  const std::vector<Rgb> shown = fixtures::random_lighting(transport.layout(), random);
  PictureErrorGuess guess[2];
  for (int run = 0; run < 2; ++run) {
    set_thread_count(run == 0 ? 1 : 5);
    guess[run] = ErrorEstimator(transport).judge(target, shown, 100);
  }
  set_thread_count(before);
  EXPECT_EQ(guess[0].estimate, guess[1].estimate);
  EXPECT_EQ(guess[0].bound, guess[1].bound);
}

/// Takes so many.
struct Count : UpdateLimit {
  int left = 0;
  void begin(std::span<const Rgb>, std::span<const Rgb>, const BandMask&) override {}
  bool take(int, const Rgb&) override { return left-- > 0; }
};

// As few wavelets as keep the estimate: with one less it would be above.
TEST(ErrorBudget, TakesWhatTheErrorAsksForAndNoMore) {
  const Transport transport = shadowed_picture();
  const auto lights = wandering_light(12, 5);
  int last = 0;
  for (const double wanted : {0.3, 0.1, 0.03}) {
    LightingOptions options;
    FrameRelighter relighter(transport, options, WaveletWeight::transport);
    relighter.set_budget({BudgetKind::error, wanted});
    options.weights = wavelet_weights(WaveletWeight::transport, transport);
    LightingTracker beside(transport.layout(), options);
    beside.start_exact(lights[0]);
    relighter.relight(lights[0], FrameStart::exact, 0);
    int updates = 0;
    for (std::size_t f = 1; f < lights.size(); ++f) {
      const LightingTracker shown_before = beside;
      const FrameMetrics& m =
          relighter.relight(lights[f], FrameStart::advance, static_cast<int>(f));
      EXPECT_LE(*m.error_estimate, wanted * (1 + 1e-5)) << f;
      EXPECT_EQ(m.wavelets, m.updates);
      updates += m.updates;
      const auto with = [&](int wavelets) {
        LightingTracker tracker = shown_before;
        Count count;
        count.left = wavelets;
        tracker.advance(lights[f], count);
        return tracker;
      };
      beside = with(m.updates);
      const std::span<const Rgb> shown = relighter.tracker().shown();
      EXPECT_TRUE(std::equal(shown.begin(), shown.end(), beside.shown().begin())) << f;
      if (m.updates <= 1 || !(*m.error_estimate > 0)) continue;
      ErrorEstimator estimator(transport);
      estimator.begin(lights[f], with(m.updates - 1).shown());
      const double less = estimator.estimate();
      estimator.begin(lights[f], beside.shown());
      // This estimator and the relighter's differ by the calibration alone, which both have used
      // for all of a frame.
      EXPECT_GT(less * *m.error_estimate / estimator.estimate(), wanted * (1 - 1e-5)) << f;
    }
    EXPECT_GT(updates, last);
    last = updates;
  }
}

// Vertices weigh by what is seen of them, from where the camera is in the frame that is decided.
TEST(ErrorBudget, KnowsTheViewItDecidesFor) {
  const Transport transport = random_mesh();
  const auto lights = wandering_light(12, 5);
  FrameRelighter relighter(transport, {}, WaveletWeight::transport);
  relighter.set_budget({BudgetKind::error, 0.1});
  relighter.relight(lights[0], FrameStart::exact, 0);
  const Vec3 eyes[] = {{0, 0, 3.2}, {3.2, 0, 0}, {0, -3.2, 0.1}, {-1.4, 0.2, 0}};
  for (std::size_t f = 1; f < lights.size(); ++f) {
    relighter.set_camera(look_at(eyes[f % 4], {}, 0.6, 24, 20));
    const FrameMetrics& m = relighter.relight(lights[f], FrameStart::advance, static_cast<int>(f));
    EXPECT_LE(*m.error_estimate, 0.1 * (1 + 1e-5)) << f;
  }
}

TEST(ErrorBudget, RefusesWhatItCannotKeep) {
  const Transport transport = random_picture();
  FrameRelighter relighter(transport, {}, WaveletWeight::area);
  for (const double wrong : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THROW(relighter.set_budget({BudgetKind::error, wrong}), Error);
    EXPECT_THROW(relighter.set_budget({BudgetKind::milliseconds, wrong}), Error);
  }
}

TEST(Flicker, IsTheChangeThatTheExactPictureDoesNotMake) {
  const Transport transport = random_picture();
  LightingOptions options;
  options.wavelets = 20;
  FrameRelighter relighter(transport, options, WaveletWeight::area);
  relighter.compare_with_reference(true);
  std::vector<Image> shown, exact;
  for (const std::vector<Rgb>& target : wandering_light(10, 9)) {
    const int frame = static_cast<int>(shown.size());
    const FrameMetrics& m =
        relighter.relight(target, frame == 0 ? FrameStart::exact : FrameStart::advance, frame);
    shown.push_back(relighter.picture());
    exact.push_back(*relighter.reference());
    double difference = 0, norm = 0;
    const auto f = static_cast<std::size_t>(frame);
    for (std::size_t i = 0; frame > 0 && i < shown[0].pixels.size(); ++i) {
      const RgbD d = (RgbD(shown[f].pixels[i]) - RgbD(shown[f - 1].pixels[i])) -
                     (RgbD(exact[f].pixels[i]) - RgbD(exact[f - 1].pixels[i]));
      const RgbD r(exact[f].pixels[i]);
      difference += d.r * d.r + d.g * d.g + d.b * d.b;
      norm += r.r * r.r + r.g * r.g + r.b * r.b;
    }
    ASSERT_TRUE(m.flicker);
    if (norm > 0) {
      EXPECT_NEAR(*m.flicker, std::sqrt(difference / norm), 1e-12);
    } else {
      EXPECT_TRUE(*m.flicker == 0 || std::isinf(*m.flicker));
    }
  }
}

}  // namespace
}  // namespace haarlight
