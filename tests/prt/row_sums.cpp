// The invariant everything rests on: sums == T * shown, whatever happened before.

#include "prt/row_sums.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <random>

#include "core/parallel.h"
#include "prt/apply_kernel.h"
#include "prt/image_relighter.h"
#include "prt/lighting_tracker.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;

// T * light with the dense matrix, in long double, and the magnitude S = sum |T| |light| of bounds.
struct Product {
  std::vector<double> value, magnitude;  // [output * 3 + channel]
};

Product multiply(const std::vector<double>& t, std::span<const Rgb> light) {
  const std::size_t size = light.size();
  Product out;
  for (std::size_t row = 0; row < t.size() / size; ++row) {
    long double sum = 0, magnitude = 0;
    for (std::size_t j = 0; j < size; ++j) {
      const float l = row % 3 == 0 ? light[j].r : row % 3 == 1 ? light[j].g : light[j].b;
      sum += static_cast<long double>(t[row * size + j]) * l;
      magnitude += std::abs(static_cast<long double>(t[row * size + j]) * l);
    }
    out.value.push_back(static_cast<double>(sum));
    out.magnitude.push_back(static_cast<double>(magnitude));
  }
  return out;
}

// Totals of a relighter's rows with colours applied, as outputs.
std::vector<double> outputs(const RowSums& sums) {
  const Transport& t = sums.transport();
  std::vector<double> out(3 * static_cast<std::size_t>(t.width()) *
                          static_cast<std::size_t>(t.height()));
  for (std::size_t row = 0; row < t.row_output().size(); ++row) {
    if (t.row_output()[row] == kNoOutput) continue;
    const std::size_t block = row / kBlockRows, r = row % kBlockRows;
    const double* total = sums.totals().data() + block * kBlockTotals;
    const RgbD color(t.row_color()[row]);
    out[3 * t.row_output()[row]] = color.r * total[r];
    out[3 * t.row_output()[row] + 1] = color.g * total[kBlockRows + r];
    out[3 * t.row_output()[row] + 2] = color.b * total[2 * kBlockRows + r];
  }
  return out;
}

TEST(ApplyKernel, EveryVersionEqualsThePlainLoop) {
  std::mt19937_64 random(1);
  for (const double density : {0.05, 0.5, 1.0}) {
    const SmallTransport small = fixtures::small_transport(8, 128, 64, 3, density);
    const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (const std::size_t count : {0, 1, 2, 63, 64, 65, 200}) {
      for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
        std::vector<ColumnTask> tasks;
        for (int j = 0; tasks.size() < count && j < transport.layout().size(); ++j) {
          const ColumnBlocks blocks = transport.column(chunk, j);
          if (!blocks.present) continue;
          tasks.push_back({blocks, {uniform(random), uniform(random), uniform(random)}});
        }
        std::vector<double> plain(kChunkTotals, 0.25), fast = plain;
        apply_columns_portable(transport.rgb_blocks(chunk), tasks, plain.data());
        apply_columns(transport.rgb_blocks(chunk), tasks, fast.data());
        // Entries are below 0.1: each of the `count` products rounds once more without FMA.
        const double bound = 2 * 0x1p-53 * (0.25 + 0.1 * static_cast<double>(count)) *
                             static_cast<double>(count + 1);
        for (std::size_t i = 0; i < plain.size(); ++i) {
          ASSERT_NEAR(fast[i], plain[i], bound)
              << apply_kernel_name() << " " << count << " at " << i;
        }
      }
    }
  }
}

struct Case {
  LightingMethod method;
  int wavelets;
  bool expect_resets;
  bool short_logs = false;
};

class Invariant : public ::testing::TestWithParam<Case> {};

TEST_P(Invariant, SumsEqualTransportTimesShown) {
  // 64x64 pixels and face 8: band 2 is large enough for its log to be folded.
  const SmallTransport small = fixtures::small_transport(8, 64, 64, 11);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const auto t = fixtures::dense(small);
  const HaarLayout& layout = transport.layout();
  std::mt19937_64 random(12);
  LightingOptions options;
  options.method = GetParam().method;
  options.wavelets = GetParam().wavelets;
  LightingTracker tracker(layout, options);
  RowSums sums(transport);
  sums.expect_resets(GetParam().expect_resets);
  sums.keep_logs_short(GetParam().short_logs);

  auto target = fixtures::random_lighting(layout, random);
  sums.apply(tracker.start_exact(target));
  std::vector<double> peak(t.size() / static_cast<std::size_t>(layout.size()), 0.0);
  double updates = 0;
  for (int frame = 0; frame < 40; ++frame) {
    switch (random() % 6) {
      case 0:
        target = fixtures::random_lighting(layout, random);
        break;
      case 1:
        target.assign(target.size(), Rgb{});
        break;
      case 2:
        target[random() % target.size()] = {1e6f, 5e5f, 2e6f};
        break;
      case 3:
        for (int i = layout.band(2).begin; i < layout.band(2).end; ++i) {
          target[static_cast<std::size_t>(i)] = -target[static_cast<std::size_t>(i)];
        }
        break;
      case 4:
        options.method =
            options.method == LightingMethod::pbi ? LightingMethod::bi : LightingMethod::pbi;
        tracker.set_options(options);
        break;
      default:
        break;
    }
    const LightingUpdate& update = tracker.advance(target);
    updates += static_cast<double>(update.deltas.size()) + layout.size();
    if (frame % 2 == 0) {
      sums.apply(update);
    } else {
      // In two parts: the deltas dealt out, resets with the first.
      LightingUpdate first, rest;
      first.reset = update.reset;
      for (const WaveletDelta& delta : update.deltas) {
        (random() % 3 ? first : rest).deltas.push_back(delta);
      }
      sums.apply(first, {}, UpdatePart::first);
      sums.apply(rest, {}, UpdatePart::rest);
    }
    const Product right = multiply(t, tracker.shown());
    const auto found = outputs(sums);
    for (std::size_t i = 0; i < found.size(); ++i) {
      peak[i] = std::max(peak[i], right.magnitude[i]);
      // Bound A of the hard cases: (K + 2n) 2^-53 S. Taken-back bands count their columns in K.
      const double bound = (updates + 2.0 * layout.size()) * 0x1p-53 * peak[i];
      ASSERT_NEAR(found[i], right.value[i], bound) << "frame " << frame << " output " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Invariant,
                         ::testing::Values(Case{LightingMethod::nwa, 30, true},
                                           Case{LightingMethod::bi, 30, false},
                                           Case{LightingMethod::pbi, 30, true},
                                           Case{LightingMethod::pbi, 100, true},
                                           Case{LightingMethod::pbi, 10, false},
                                           Case{LightingMethod::pbi, 30, true, true},
                                           Case{LightingMethod::reference, 1, false}));

TEST(RowSums, ASunToggledTenThousandTimesLeavesNothing) {
  SmallTransport small = fixtures::small_transport(8, 8, 8, 21);
  std::mt19937_64 random(22);
  const HaarLayout layout(8);
  small.tiles[0] = fixtures::unit_tile(layout, random);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const auto t = fixtures::dense(small);
  // A sky of about 1, and in one texel a sun of 1e6.
  std::uniform_real_distribution<float> uniform(0.5f, 1.5f);
  std::vector<Rgb> sky(static_cast<std::size_t>(layout.size())), dim(sky.size()), sunny(sky.size());
  for (Rgb& c : sky) c = {uniform(random), uniform(random), uniform(random)};
  haar_forward(layout, std::span<const Rgb>(sky), dim);
  sky[100] = {1e6f, 1e6f, 1e6f};
  haar_forward(layout, std::span<const Rgb>(sky), sunny);
  for (LightingMethod method : {LightingMethod::bi, LightingMethod::pbi}) {
    LightingOptions options;
    options.method = method;
    options.wavelets = 30;
    LightingTracker tracker(layout, options);
    RowSums sums(transport);
    sums.apply(tracker.start_exact(dim));
    for (int toggle = 0; toggle < 10000; ++toggle) {
      sums.apply(tracker.advance(sunny));
      sums.apply(tracker.advance(dim));
    }
    for (int frame = 0; frame < 20; ++frame) sums.apply(tracker.advance(dim));
    const Product right = multiply(t, dim);
    const auto found = outputs(sums);
    double worst = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      worst = std::max(worst, std::abs(found[i] - right.value[i]));
    }
    EXPECT_LE(worst, 1e-7) << lighting_method_name(method);
  }
}

TEST(RowSums, LightsOutIsPositiveZeroBitForBit) {
  const SmallTransport small = fixtures::small_transport(8, 64, 64, 31);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  std::mt19937_64 random(32);
  const std::vector<Rgb> dark(static_cast<std::size_t>(transport.layout().size()));
  for (LightingMethod method : {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
    LightingOptions options;
    options.method = method;
    options.wavelets = 100;
    LightingTracker tracker(transport.layout(), options);
    RowSums sums(transport);
    sums.apply(tracker.start_exact(fixtures::random_lighting(transport.layout(), random)));
    for (int frame = 0; frame < 5; ++frame) {
      sums.apply(tracker.advance(fixtures::random_lighting(transport.layout(), random)));
    }
    for (int frame = 0; frame < 10; ++frame) sums.apply(tracker.advance(dark));
    for (const double total : sums.totals()) {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(total), 0u) << lighting_method_name(method);
    }
  }
}

TEST(RowSums, OneAndSevenThreadsGiveTheSameBits) {
  const SmallTransport small = fixtures::small_transport(8, 200, 130, 41);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const auto run = [&](int threads) {
    set_thread_count(threads);
    std::mt19937_64 random(42);
    LightingTracker tracker(transport.layout(), {});
    RowSums sums(transport);
    sums.apply(tracker.start_exact(fixtures::random_lighting(transport.layout(), random)));
    for (int frame = 0; frame < 20; ++frame) {
      sums.apply(tracker.advance(fixtures::random_lighting(transport.layout(), random)));
    }
    return std::vector<double>(sums.totals().begin(), sums.totals().end());
  };
  const auto one = run(1), seven = run(7);
  set_thread_count(2);
  EXPECT_EQ(std::memcmp(one.data(), seven.data(), one.size() * sizeof(double)), 0);
}

TEST(RowSums, AnEmptyUpdateTouchesNothing) {
  const SmallTransport small = fixtures::small_transport(8, 64, 64, 51);
  RowSums sums(build_transport(small.info, small.tiles, small.thresholds));
  std::mt19937_64 random(52);
  LightingTracker tracker(sums.transport().layout(), {});
  sums.apply(tracker.start_exact(fixtures::random_lighting(tracker.layout(), random)));
  int chunks = 0;
  const ApplyStats stats = sums.apply({}, [&](int, const double*) { ++chunks; });
  EXPECT_EQ(chunks, 0);
  EXPECT_EQ(stats.transport_bytes, 0u);
  EXPECT_EQ(stats.sum_bytes, 0u);
  EXPECT_EQ(stats.columns, 0);
}

// Whoever makes pixels of chunks hears of each that changed, once, when the second part is done.
TEST(RowSums, OfTwoPartsTheChunksOfBothAreHandedOutAtTheEnd) {
  const SmallTransport small = fixtures::small_transport(8, 200, 130, 55, 0.05);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const HaarLayout& layout = transport.layout();
  std::mt19937_64 random(56);
  for (int round = 0; round < 20; ++round) {
    RowSums whole(transport), parts(transport);
    LightingUpdate all, first, rest;
    for (int j = layout.size() - 40; j < layout.size(); j += 1 + static_cast<int>(random() % 9)) {
      all.deltas.push_back({j, {1, 2, 3}});
      (round == 0 || random() % 2 ? first : rest).deltas.push_back(all.deltas.back());
    }
    std::vector<int> expected(static_cast<std::size_t>(transport.chunk_count())), told = expected;
    whole.apply(all,
                [&](int chunk, const double*) { ++expected[static_cast<std::size_t>(chunk)]; });
    const auto tell = [&](int chunk, const double* totals) {
      ++told[static_cast<std::size_t>(chunk)];
      const std::size_t at = static_cast<std::size_t>(chunk) * kChunkTotals;
      EXPECT_EQ(totals, parts.totals().data() + at);
    };
    parts.apply(first, tell, UpdatePart::first);
    EXPECT_EQ(std::count(told.begin(), told.end(), 0), std::ssize(told));
    parts.apply(rest, tell, UpdatePart::rest);
    EXPECT_EQ(told, expected);
    parts.apply({}, tell);
    EXPECT_EQ(told, expected) << "again";
    // Two columns of a row are added in another order: one rounding each, of sums below 240.
    for (std::size_t i = 0; i < whole.totals().size(); ++i) {
      ASSERT_NEAR(parts.totals()[i], whole.totals()[i], 240 * 80 * 0x1p-53);
    }
  }
}

// Short logs: the dearest reset is a kept picture and one picture's worth of columns, or the update
// of a frame.
TEST(RowSums, ShortLogsBoundWhatAResetStreams) {
  const SmallTransport small = fixtures::small_transport(16, 64, 64, 57, 0.9);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  RowSums sums(transport);
  const HaarLayout& layout = transport.layout();
  const int band = layout.band_count() - 1;
  const auto picture = sums.totals().size_bytes();
  std::uint64_t longest[2] = {};
  for (const bool keep_short : {false, true}) {
    RowSums other(transport);
    other.keep_logs_short(keep_short);
    for (int j = layout.band(band).begin; j < layout.band(band).end; ++j) {
      LightingUpdate update;
      update.deltas.push_back({j, {1, 1, 1}});
      other.apply(update);
      longest[keep_short] = std::max(longest[keep_short], other.reset_bytes(band));
    }
  }
  EXPECT_LE(longest[1], 4 * picture + 2 * transport.column_bytes(layout.band(band).begin));
  EXPECT_GT(longest[0], longest[1] + picture);
}

TEST(RowSums, WhatAResetWouldStreamIsKnownBefore) {
  const SmallTransport small = fixtures::small_transport(8, 200, 130, 53, 0.2);
  RowSums sums(build_transport(small.info, small.tiles, small.thresholds));
  const Transport& transport = sums.transport();
  const HaarLayout& layout = transport.layout();
  const int band = layout.band_count() - 1, begin = layout.band(band).begin;
  LightingUpdate update;
  update.deltas.push_back({0, {1, 1, 1}});  // light that stays
  std::uint64_t runs = 0;
  for (int j = begin; j < begin + 40; j += 3) {
    update.deltas.push_back({j, {1, 2, 3}});
    std::uint64_t of_column = 0;
    for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
      of_column += transport.column(chunk, j).present != nullptr;
    }
    EXPECT_EQ(sums.column_runs(j), of_column);
    runs += of_column;
  }
  sums.apply(update);
  sums.apply(update);  // the same columns: no longer a log
  EXPECT_GT(runs, 0u);
  EXPECT_EQ(sums.reset_runs(band), runs);
  const std::uint64_t bytes = sums.reset_bytes(band);
  LightingUpdate reset;
  reset.reset[static_cast<std::size_t>(band)] = true;
  EXPECT_EQ(sums.apply(reset).transport_bytes, bytes);
  EXPECT_EQ(sums.reset_runs(band), 0u);
  EXPECT_EQ(sums.reset_bytes(band), 0u);
}

TEST(ImageRelighter, AgreesWithTheOneCallAndWithTheDenseProduct) {
  const SmallTransport small = fixtures::small_transport(8, 37, 29, 61);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  std::mt19937_64 random(62);
  ImageRelighter relighter(transport);
  LightingTracker tracker(transport.layout(), {});
  relighter.apply(tracker.start_exact(fixtures::random_lighting(transport.layout(), random)));
  for (int frame = 0; frame < 10; ++frame) {
    relighter.apply(tracker.advance(fixtures::random_lighting(transport.layout(), random)));
  }
  const Image once = relight_once(transport, tracker.shown());
  const Product right = multiply(fixtures::dense(small), tracker.shown());
  for (std::size_t i = 0; i < once.pixels.size(); ++i) {
    const Rgb& a = relighter.picture().pixels[i];
    const Rgb& b = once.pixels[i];
    // Two float roundings: of the sum and of the product with the colour.
    const double bound = 4 * 0x1p-24 * right.magnitude[3 * i + 1] + 1e-12;
    ASSERT_NEAR(a.g, b.g, bound);
    ASSERT_NEAR(a.g, right.value[3 * i + 1], bound);
    ASSERT_NEAR(a.r, right.value[3 * i], 4 * 0x1p-24 * right.magnitude[3 * i] + 1e-12);
  }
}

}  // namespace
}  // namespace haarlight
