// NWA, BI and PBI: what an update contains, and what repeated updates come to.

#include "prt/lighting_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

LightingOptions with(LightingMethod method, int wavelets) {
  LightingOptions options;
  options.method = method;
  options.wavelets = wavelets;
  return options;
}

// A consumer of updates that holds the lighting itself: what every picture is T times of.
struct Follower {
  explicit Follower(const HaarLayout& l) : layout(l), light(static_cast<std::size_t>(l.size())) {}
  void apply(const LightingUpdate& update) {
    for (int b = 0; b < layout.band_count(); ++b) {
      if (!update.reset[static_cast<std::size_t>(b)]) continue;
      for (int i = layout.band(b).begin; i < layout.band(b).end; ++i) {
        light[static_cast<std::size_t>(i)] = {};
      }
    }
    int last = -1;
    for (const WaveletDelta& d : update.deltas) {
      ASSERT_GT(d.index, last) << "deltas ascend without repeats";
      last = d.index;
      light[static_cast<std::size_t>(d.index)] += d.delta;
    }
  }
  HaarLayout layout;
  std::vector<RgbD> light;
};

const LightingMethod kAllMethods[] = {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi,
                                      LightingMethod::reference};

TEST(LightingTracker, ShownIsWhatAFollowerOfTheUpdatesHolds) {
  const HaarLayout layout(8);
  std::mt19937_64 random(1);
  for (LightingMethod method : kAllMethods) {
    for (BandChoice choice : {BandChoice::simple, BandChoice::exhaustive}) {
      LightingOptions options = with(method, 17);
      options.band_choice = choice;
      LightingTracker tracker(layout, options);
      Follower follower(layout);
      auto target = fixtures::random_lighting(layout, random);
      follower.apply(tracker.start_exact(target));
      for (int frame = 0; frame < 60; ++frame) {
        if (frame % 7 == 0) target = fixtures::random_lighting(layout, random);
        if (frame == 30) target.assign(target.size(), Rgb{});
        follower.apply(tracker.advance(target));
        for (std::size_t i = 0; i < target.size(); ++i) {
          // Two roundings to double at most since the delta before.
          ASSERT_NEAR(follower.light[i].g, static_cast<double>(tracker.shown()[i].g), 200 * 0x1p-52)
              << lighting_method_name(method) << " frame " << frame << " coefficient " << i;
        }
      }
    }
  }
}

TEST(LightingTracker, AnUpdateHasAtMostItsBudget) {
  const HaarLayout layout(16);
  std::mt19937_64 random(2);
  for (LightingMethod method : {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
    LightingTracker tracker(layout, with(method, 30));
    for (int frame = 0; frame < 20; ++frame) {
      EXPECT_LE(tracker.advance(fixtures::random_lighting(layout, random)).deltas.size(), 30u);
    }
  }
}

TEST(LightingTracker, StillLightIsReachedExactlyAndThenNothingChanges) {
  const HaarLayout layout(16);
  std::mt19937_64 random(3);
  const auto before = fixtures::random_lighting(layout, random);
  const auto target = fixtures::random_lighting(layout, random);
  for (LightingMethod method : {LightingMethod::bi, LightingMethod::pbi}) {
    LightingTracker tracker(layout, with(method, 50));
    tracker.start_exact(before);
    const int enough = (layout.size() + 49) / 50;
    for (int frame = 0; frame < enough; ++frame) tracker.advance(target);
    for (std::size_t i = 0; i < target.size(); ++i) ASSERT_EQ(tracker.shown()[i], target[i]) << i;
    EXPECT_EQ(lighting_error(layout, tracker.shown(), target), 0.0);
    for (int frame = 0; frame < 10; ++frame) EXPECT_TRUE(tracker.advance(target).empty());
  }
}

TEST(LightingTracker, NwaChoosesTheLargestAreaWeightedCoefficients) {
  const HaarLayout layout(8);
  std::vector<Rgb> target(static_cast<std::size_t>(layout.size()));
  // Equal orthonormal size: sqrt(area) decides, so coarser bands win.
  target[3] = target[30] = target[200] = {1, 1, 1};
  target[100] = {3, 0, 0};  // the L1 norm over channels is the same 3, band 2 (area 4)
  LightingTracker tracker(layout, with(LightingMethod::nwa, 2));
  const LightingUpdate& update = tracker.advance(target);
  ASSERT_EQ(update.deltas.size(), 2u);
  EXPECT_EQ(update.deltas[0].index, 3);
  EXPECT_EQ(update.deltas[1].index, 30);
  EXPECT_EQ(update.reset.count(), 3u);
}

TEST(LightingTracker, PbiResetsExactlyTheBandsThatAreFartherFromShownThanFromBlack) {
  const HaarLayout layout(8);
  std::vector<Rgb> first(static_cast<std::size_t>(layout.size())), second(first.size());
  first[0] = {10, 10, 10}, second[0] = {11, 11, 11};  // band 0: close to shown, keep
  first[50] = {1, 1, 1}, second[60] = {1, 1, 1};      // band 1: moved entirely, 2 > 1, reset
  first[150] = {2, 2, 2}, second[150] = {1, 1, 1};    // band 2: 1 against 1, a tie resets
  LightingTracker tracker(layout, with(LightingMethod::pbi, 10));
  tracker.start_exact(first);
  const LightingUpdate& update = tracker.advance(second);
  EXPECT_FALSE(update.reset[0]);
  EXPECT_TRUE(update.reset[1]);
  EXPECT_TRUE(update.reset[2]);
  ASSERT_EQ(update.deltas.size(), 3u);
  EXPECT_EQ(update.deltas[0], (WaveletDelta{0, {1, 1, 1}}));
  EXPECT_EQ(update.deltas[1], (WaveletDelta{60, {1, 1, 1}}));
  EXPECT_EQ(update.deltas[2], (WaveletDelta{150, {1, 1, 1}}));  // from zero, not from 2
}

// The exhaustive search against trying every combination by really running it.
TEST(LightingTracker, ExhaustiveSearchLeavesTheLeastWeightedError) {
  const HaarLayout layout(8);
  std::mt19937_64 random(9);
  const auto weights = area_weights(layout);
  const auto left = [&](std::span<const Rgb> shown, std::span<const Rgb> target) {
    double sum = 0;
    for (std::size_t i = 0; i < target.size(); ++i) {
      sum += static_cast<double>(weights[i] * l1_norm(target[i] - shown[i]));
    }
    return sum;
  };
  for (int round = 0; round < 40; ++round) {
    const auto first = fixtures::random_lighting(layout, random);
    auto second = fixtures::random_lighting(layout, random);
    for (std::size_t i = 0; i < second.size(); ++i) {
      if (random() % 2) second[i] = first[i];
    }
    LightingOptions options = with(LightingMethod::pbi, 25);
    options.band_choice = BandChoice::exhaustive;
    LightingTracker tracker(layout, options);
    tracker.start_exact(first);
    tracker.advance(second);
    const double found = left(tracker.shown(), second);
    double least = std::numeric_limits<double>::infinity();
    for (unsigned mask = 0; mask < 8; ++mask) {
      std::vector<Rgb> shown = first;
      for (int b = 0; b < 3; ++b) {
        if (!(mask >> b & 1)) continue;
        for (int i = layout.band(b).begin; i < layout.band(b).end; ++i) {
          shown[static_cast<std::size_t>(i)] = {};
        }
      }
      std::vector<float> key(shown.size());
      for (std::size_t i = 0; i < key.size(); ++i) {
        key[i] = weights[i] * l1_norm(second[i] - shown[i]);
      }
      std::vector<int> chosen;
      TopK().select(key, 25, chosen);
      for (int i : chosen) shown[static_cast<std::size_t>(i)] = second[static_cast<std::size_t>(i)];
      least = std::min(least, left(shown, second));
    }
    EXPECT_NEAR(found, least, 1e-5 * least) << "round " << round;
  }
}

TEST(LightingTracker, AMovedAreaLightOverBlackIsExactInThreeFramesAtAHundredWavelets) {
  // Overbeck 2006, section 3: sparse changes converge at once. A 5x5 texel light on a 64 face
  // touches few wavelets; two places of it fewer than 300.
  const HaarLayout layout(64);
  const auto light_at = [&](int x0) {
    std::vector<float> texels(static_cast<std::size_t>(layout.size()), 0.0f), c(texels.size());
    for (int y = 20; y < 25; ++y) {
      for (int x = x0; x < x0 + 5; ++x) texels[static_cast<std::size_t>(64 * y + x)] = 50;
    }
    haar_forward(layout, std::span<const float>(texels), c);
    std::vector<Rgb> out;
    for (float v : c) out.push_back({v, v, v});
    return out;
  };
  for (LightingMethod method : {LightingMethod::bi, LightingMethod::pbi}) {
    LightingTracker tracker(layout, with(method, 100));
    tracker.start_exact(light_at(10));
    for (int x = 11; x < 40; ++x) tracker.advance(light_at(x));
    const auto rest = light_at(40);
    for (int frame = 0; frame < 3; ++frame) tracker.advance(rest);
    EXPECT_EQ(lighting_error(layout, tracker.shown(), rest), 0.0) << lighting_method_name(method);
  }
}

TEST(LightingTracker, ARoundedDeltaIsMadeGood) {
  // 1e30 down to 1e-3 cannot be a double difference exactly; going dark must still end at zero.
  const HaarLayout layout(1);
  LightingTracker tracker(layout, with(LightingMethod::bi, 6));
  Follower follower(layout);
  for (const float value : {1e18f, 1e-3f, 1e18f, 3e-3f, 0.0f}) {
    follower.apply(tracker.advance(std::vector<Rgb>(6, Rgb{value, value, value})));
  }
  for (const RgbD& c : follower.light) EXPECT_EQ(c, RgbD{});
}

TEST(LightingTracker, RefusesBadInputAndStaysAsItWas) {
  const HaarLayout layout(4);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  LightingTracker tracker(layout, with(LightingMethod::pbi, 10));
  std::vector<Rgb> good(96, Rgb{1, 2, 3});
  tracker.advance(good);
  const std::vector<Rgb> shown(tracker.shown().begin(), tracker.shown().end());
  for (const float bad : {nan, std::numeric_limits<float>::infinity(), 1e20f}) {
    auto target = good;
    target[40].b = bad;
    EXPECT_THROW(tracker.advance(target), Error);
    target[40] = {bad, 0, 0};
    EXPECT_THROW(tracker.advance(target), Error);
  }
  EXPECT_THROW(tracker.advance(std::span<const Rgb>(good).first(95)), Error);
  EXPECT_THROW(tracker.set_options(with(LightingMethod::pbi, 0)), Error);
  LightingOptions weights = with(LightingMethod::pbi, 10);
  weights.weights.assign(95, 1.0f);
  EXPECT_THROW(tracker.set_options(weights), Error);
  weights.weights.assign(96, 1.0f);
  weights.weights[7] = nan;
  EXPECT_THROW(tracker.set_options(weights), Error);
  EXPECT_TRUE(std::equal(shown.begin(), shown.end(), tracker.shown().begin()));
  EXPECT_EQ(tracker.options().wavelets, 10);
}

TEST(LightingError, IsRelativeAndAreaWeighted) {
  const HaarLayout layout(8);
  std::vector<Rgb> target(static_cast<std::size_t>(layout.size())), shown(target.size());
  EXPECT_EQ(lighting_error(layout, shown, target), 0.0);
  target[0] = {1, 0, 0};     // area 64, weight 8
  target[200] = {0, -2, 0};  // area 4, weight 2
  EXPECT_DOUBLE_EQ(lighting_error(layout, shown, target), 1.0);
  shown[0] = target[0];
  EXPECT_DOUBLE_EQ(lighting_error(layout, shown, target), 4.0 / 12.0);
}

}  // namespace
}  // namespace haarlight
