// Wavelets that fit a time, on clocks that are made up.

#include "prt/time_budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "prt/lighting_tracker.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using Clock = TimeBudget::Clock;

Clock::time_point g_now;
Clock::time_point made_up_now() { return g_now; }
void pass(double milliseconds) {
  g_now += std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double, std::milli>(milliseconds));
}

constexpr int kColumns = 20000;
constexpr double kDecideMs = 0.25;

/// A machine: what a frame takes whose columns and bands are so many bytes.
struct Machine {
  double fixed, per_byte, noise;
  double hiccups = 0;  // share of frames that take 1.5 times as long
};

struct Outcome {
  double within = 0, spent = 0;  // share of frames within 1.1 times, mean time over wanted
};

Outcome run(const Machine& machine, double wanted, int frames, int first = 0) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  std::vector<double> bytes(kColumns);
  for (double& b : bytes) b = 2000 + 60000 * uniform(random) * uniform(random);
  TimeBudget budget(bytes);
  budget.set_clock(made_up_now);
  Outcome out;
  for (int frame = 0; frame < frames; ++frame) {
    double reset_bytes[HaarLayout::kMaxBands];
    for (double& r : reset_bytes) r = 3e6 * uniform(random);
    budget.start(wanted, g_now, reset_bytes, 0);
    pass(kDecideMs);
    BandMask reset;
    reset[4] = uniform(random) < 0.2;
    reset[5] = uniform(random) < 0.4;
    budget.begin({}, {}, reset);
    double moved = (reset[4] ? reset_bytes[4] : 0) + (reset[5] ? reset_bytes[5] : 0);
    for (int rank = 0; rank < kColumns; ++rank) {
      const auto j = static_cast<int>(random() % kColumns);
      if (!budget.take(j, {1, 1, 1})) break;
      moved += bytes[static_cast<std::size_t>(j)];
    }
    double ms = machine.fixed + machine.per_byte * moved;
    ms *= 1 + machine.noise * normal(random);
    if (uniform(random) < machine.hiccups) ms *= 1.5;
    pass(ms);
    budget.finish(kDecideMs + ms);
    if (frame < first) continue;
    out.within += kDecideMs + ms <= 1.1 * wanted;
    out.spent += (kDecideMs + ms) / wanted;
  }
  out.within /= frames - first;
  out.spent /= frames - first;
  return out;
}

// The figures asked for: 99 % of 1,000 frames within 1.1 T, at least 85 % of T spent, from the
// first frame on. Noise of 5 % is what a machine of its own has; 0.5 % hiccups leave half of the
// slips.
TEST(TimeBudget, StaysWithinTheTimeAndSpendsIt) {
  for (const double fixed : {0.1, 0.8}) {
    for (const double gigabytes_per_second : {3.0, 12.0}) {
      for (const double wanted : {4.0, 8.0, 16.0}) {
        for (const double hiccups : {0.0, 0.005}) {
          const Machine machine{fixed, 1e-6 / gigabytes_per_second, 0.05, hiccups};
          const Outcome out = run(machine, wanted, 1000);
          EXPECT_GE(out.within, 0.99) << fixed << " " << gigabytes_per_second << " " << wanted;
          EXPECT_GE(out.spent, 0.85) << fixed << " " << gigabytes_per_second << " " << wanted;
        }
      }
    }
  }
}

TEST(TimeBudget, ASlowMachineStillMoves) {
  // 100 times slower than anything fits: one wavelet a frame, which is the least there is.
  const Outcome out = run({20, 1e-4, 0.05}, 4, 50);
  EXPECT_EQ(out.within, 0);
}

TEST(TimeBudget, AFrameWithoutWorkTeachesNothing) {
  std::vector<double> bytes(100, 1e4);
  TimeBudget budget(bytes);
  budget.set_clock(made_up_now);
  const std::array<double, HaarLayout::kMaxBands> none{};
  const auto allowed = [&](bool learn) {
    budget.start(4, g_now, none, 0);
    budget.begin({}, {}, {});
    int taken = 0;
    while (taken < 100000 && budget.take(taken % 100, {})) ++taken;
    if (learn) budget.finish(1 + 1e-4 * taken);
    return taken;
  };
  for (int i = 0; i < 50; ++i) allowed(true);
  const int before = allowed(true);
  for (int i = 0; i < 50; ++i) {
    budget.start(4, g_now, none, 0);
    budget.begin({}, {}, {});
    budget.finish(0.01);
  }
  EXPECT_NEAR(allowed(true), before, 0.05 * before);
}

// A band that is reset is taken back by streaming its columns again, which is budgeted for; where
// all are, as with NWA or when PBI forgets all, sums start from zero and it costs nothing.
TEST(TimeBudget, ResetsAreBudgetedForUnlessNothingStays) {
  TimeBudget budget(std::vector<double>(100, 1e4));
  budget.set_clock(made_up_now);
  std::array<double, HaarLayout::kMaxBands> to_take_back{};
  std::fill_n(to_take_back.begin(), 6, 2e5);
  const auto taken = [&](const BandMask& reset) {
    budget.start(4, g_now, to_take_back, 0);
    budget.begin({}, {}, reset);
    int count = 0;
    while (count < 100000 && budget.take(count % 100, {})) ++count;
    return count;
  };
  for (int i = 0; i < 50; ++i) {  // 10 MB a ms beside 0.5 ms
    const int count = taken({});
    budget.finish(0.5 + 1e-7 * 1e4 * count);
  }
  const int all = taken({});
  EXPECT_GT(all, 1000);
  BandMask some;
  some[2] = some[5] = true;
  EXPECT_EQ(taken(some), all - 40);  // two bands of 20 columns each
  BandMask every;
  for (std::size_t b = 0; b < 6; ++b) every[b] = true;
  EXPECT_EQ(taken(every), all);
}

TEST(FrameTimeModel, FindsFixedAndPerByte) {
  FrameTimeModel model;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0.2, 2);
  for (int i = 0; i < 200; ++i) {
    const double bytes = 1e7 * uniform(random);
    model.add(bytes, 0.7 + 2e-7 * bytes);
  }
  // The prior of "half is fixed" still weighs 0.05 of the mean's square against a variance of 0.22.
  EXPECT_NEAR(model.predict(1e7), 2.7, 0.1);
  EXPECT_NEAR(model.predict(2e7), 4.7, 0.3);
  EXPECT_NEAR(model.bytes_within(2.7), 1e7, 5e5);
  EXPECT_EQ(model.bytes_within(0.01), 0);
}

/// Takes so many.
struct Count : UpdateLimit {
  int left = 0;
  void begin(std::span<const Rgb>, std::span<const Rgb>, const BandMask&) override {}
  bool take(int, const Rgb&) override { return left-- > 0; }
};

// The ranking under a limit is that of a number of wavelets: recordings replay by the number.
TEST(UpdateLimit, TheFirstOfTheRankingAreThoseOfANumber) {
  const HaarLayout layout(16);
  std::mt19937_64 random(3);
  for (const LightingMethod method :
       {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
    LightingOptions options;
    options.method = method;
    LightingTracker by_limit(layout, options), by_number(layout, options);
    for (const int n : {1, 5, 255, 256, 257, 700, 1500}) {
      std::vector<Rgb> target = fixtures::random_lighting(layout, random);
      for (std::size_t j = 100; j < 400; ++j) target[j] = {1, 1, 1};  // ties
      options.wavelets = n;
      by_number.set_options(options);
      Count count;
      count.left = n;
      EXPECT_EQ(by_limit.advance(target, count), by_number.advance(target)) << n;
    }
  }
}

}  // namespace
}  // namespace haarlight
