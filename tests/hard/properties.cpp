// Row 4, by property testing: random sequences of every operation on trackers, running sums and
// relighters, against slow oracles. 10^5 operations; 10^7 with HAARLIGHT_HARD_FULL=1. A failing
// sequence is shrunk and printed with the seed that makes it again (RC_PARAMS=seed=...).

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <ostream>
#include <random>
#include <vector>

#include "core/error.h"
#include "cpca/cluster_relighter.h"
#include "cpca/compress.h"
#include "prt/image_relighter.h"
#include "prt/mesh_relighter.h"
#include "tests/core/temporary_folder.h"
#include "tests/cpca/inputs.h"
#include "tests/hard/hard_case.h"
#include "tests/hard/oracle.h"
#include "tests/hard/slow_tracker.h"

namespace haarlight {
namespace {

using namespace hard;

constexpr int kSequence = 1000;  // operations

// Read by rapidcheck before its first property: 100 sequences, or 10,000.
const bool kParameters = [] {
  setenv("RC_PARAMS", full() ? "seed=7 max_success=10000" : "seed=7 max_success=100", 0);
  return true;
}();

// One operation: what, and a seed for its details. Plain numbers, so that it shrinks and prints.
struct Operation {
  int kind = 0;
  unsigned seed = 0;
};
std::ostream& operator<<(std::ostream& out, const Operation& o) {
  return out << o.kind << ":" << o.seed;
}

rc::Gen<std::vector<Operation>> operations(int kinds) {
  return rc::gen::container<std::vector<Operation>>(
      kSequence, rc::gen::map(rc::gen::pair(rc::gen::inRange(0, kinds),
                                            rc::gen::resize(100, rc::gen::arbitrary<unsigned>())),
                              [](const std::pair<int, unsigned>& p) {
                                return Operation{p.first, p.second};
                              }));
}

// A value of some size of a light's range, of either sign.
float value_of(std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  constexpr float kSizes[] = {1, 1, 1, 100, 1e6f, 1e-3f, 1e-20f, 3e-31f, 1e-40f};
  return uniform(random) * kSizes[random() % std::size(kSizes)];
}
Rgb color_of(std::mt19937& random) {
  // Now and then equal channels, so that keys tie.
  if (random() % 4 == 0) return {1, 1, 1};
  return {value_of(random), value_of(random), value_of(random)};
}

// Outputs of one consumer against T * light, within bound A and, for floats, two roundings. Looks
// at some of the rows, others in each sequence, so that long runs are of sums and not of this.
class Judge {
 public:
  explicit Judge(const fixtures::SmallTransport& small, std::size_t first = 0, std::size_t step = 1)
      : t_(fixtures::dense(small)),
        size_(static_cast<std::size_t>(HaarLayout(small.info.face_size).size())),
        first_(first % step),
        step_(step) {
    peak_.assign(t_.size() / size_, 0);
  }
  void count(const ApplyStats& stats) { updates_ += stats.columns + 10; }
  /// Largest error over its bound. `light` is of doubles or floats.
  template <typename Light>
  double of_bound(const std::vector<double>& found, const Light& light, bool rounded_to_float) {
    double worst = 0;
    for (std::size_t row = first_; row < found.size(); row += step_) {
      long double sum = 0, magnitude = 0;
      for (std::size_t j = 0; j < size_; ++j) {
        const auto l = static_cast<long double>(row % 3 == 0   ? light[j].r
                                                : row % 3 == 1 ? light[j].g
                                                               : light[j].b);
        const long double term = static_cast<long double>(t_[row * size_ + j]) * l;
        sum += term, magnitude += std::abs(term);
      }
      peak_[row] = std::max(peak_[row], static_cast<double>(magnitude));
      double bound = (updates_ + 2.0 * static_cast<double>(size_)) * 0x1p-53 * peak_[row];
      // What is less than the least float counts as nothing.
      if (rounded_to_float) bound += 2 * 0x1p-24 * static_cast<double>(magnitude) + 0x1p-125;
      const double error = std::abs(found[row] - static_cast<double>(sum));
      if (error > 0) worst = std::max(worst, bound > 0 ? error / bound : HUGE_VAL);
    }
    return worst;
  }

 private:
  std::vector<double> t_, peak_;
  std::size_t size_, first_, step_;
  double updates_ = 0;
};

// The same of clusters: U = W M light. Vectors' sums and vertices' each keep to bound A, the second
// with a change of each of a cluster's vectors a frame, and what they add up is
// sum |w| sum |M| |light|.
class ClusterJudge {
 public:
  explicit ClusterJudge(const Transport& transport)
      : info_(transport.info()), sizes_(transport.info()), m_(fixtures::dense_rows(transport)) {
    auto sizes = std::make_shared<ClusterWeights>(*info_.clusters);
    for (std::int16_t& w : sizes->weight) w = static_cast<std::int16_t>(std::abs(w));
    for (float& scale : sizes->scale) scale = std::abs(scale);
    sizes_.clusters = sizes;
    m_sizes_ = m_;
    for (double& x : m_sizes_) x = std::abs(x);
    for (std::size_t c = 0; c < static_cast<std::size_t>(sizes->clusters()); ++c) {
      most_vectors_ = std::max(most_vectors_, static_cast<double>(sizes->vectors_of(c)));
    }
    peak_.assign(info_.clusters->vertex.size() * static_cast<std::size_t>(info_.terms), {});
  }
  void count(const ApplyStats& stats) { updates_ += stats.columns + 10 + 2 * most_vectors_; }
  /// What is shown now.
  void look(std::span<const Rgb> light) {
    std::vector<Rgb> size(light.begin(), light.end());
    for (Rgb& l : size) l = {std::abs(l.r), std::abs(l.g), std::abs(l.b)};
    right_ = fixtures::combined(info_, fixtures::product(m_, light));
    const auto all = fixtures::combined(sizes_, fixtures::product(m_sizes_, size));
    for (std::size_t v = 0; v < all.size(); ++v) {
      peak_[v] = {std::max(peak_[v].r, all[v].r), std::max(peak_[v].g, all[v].g),
                  std::max(peak_[v].b, all[v].b)};
    }
    coefficients_ = static_cast<double>(light.size());
  }
  /// Largest error over its bound, with two roundings to float.
  double of_bound(std::span<const Rgb> found) const {
    double worst = 0;
    const double steps = updates_ + 2 * coefficients_ + 2 * most_vectors_;
    const auto hold = [&](float value, double right, double peak) {
      const double error = std::abs(static_cast<double>(value) - right);
      const double bound = steps * 0x1p-53 * peak + 2 * 0x1p-24 * std::abs(right) + 0x1p-125;
      worst = std::max(worst, error <= bound ? error / bound : HUGE_VAL);
    };
    for (std::size_t v = 0; v < found.size(); ++v) {
      hold(found[v].r, right_[v].r, peak_[v].r);
      hold(found[v].g, right_[v].g, peak_[v].g);
      hold(found[v].b, right_[v].b, peak_[v].b);
    }
    return worst;
  }

 private:
  TransportInfo info_, sizes_;
  std::vector<double> m_, m_sizes_;
  std::vector<RgbD> right_, peak_;
  double updates_ = 0, coefficients_ = 0, most_vectors_ = 0;
};

// One row in so many is looked at: 2 in the suite, 13 in the long version; no multiple of 3, so
// that all channels are met.
std::size_t row_step() { return full() ? 13 : 2; }

std::vector<double> doubles(std::span<const Rgb> values) {
  std::vector<double> out;
  for (const Rgb& v : values) {
    for (const float c : {v.r, v.g, v.b}) out.push_back(static_cast<double>(c));
  }
  return out;
}

double not_zero_bits(std::span<const double> totals) {
  double count = 0;
  for (const double t : totals) count += std::bit_cast<std::uint64_t>(t) != 0;
  return count;
}

// Any updates whatever, made by hand: resets of any bands with deltas of any size in the same one.
TEST(HardCases, Row04_ResetAndLargeDelta) {
  property("running sums meet bound A after any updates: resets with large deltas, in any order");
  const fixtures::SmallTransport small = fixtures::small_transport(4, 8, 8, 1);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const HaarLayout layout(4);
  double worst = 0, done = 0, dark = 0;
  rc::detail::checkGTest([&] {
    const auto sequence = *operations(6);
    Judge judge(small, static_cast<std::size_t>(done) / kSequence, row_step());
    RowSums sums(transport);
    std::vector<RgbD> light(static_cast<std::size_t>(layout.size()));
    for (const Operation& operation : sequence) {
      std::mt19937 random(operation.seed);
      LightingUpdate update;
      const auto add = [&](int index, const RgbD& delta) {
        update.deltas.push_back({index, delta});
      };
      switch (operation.kind) {
        case 0:  // a few deltas
        case 1:  // with resets
          for (std::size_t b = 0; b < static_cast<std::size_t>(layout.band_count()); ++b) {
            update.reset[b] = operation.kind == 1 && random() % 2;
          }
          for (int i = 0; i < layout.size(); ++i) {
            if (random() % 8 == 0) add(i, RgbD(color_of(random)));
          }
          break;
        case 2:  // a reset and one large delta in the same band
          update.reset[random() % 2] = true;
          add(static_cast<int>(random() % static_cast<unsigned>(layout.size())), {1e6, -1e6, 1e9});
          break;
        case 3:  // everything taken back exactly, by deltas
          for (int i = 0; i < layout.size(); ++i) {
            if (!(light[static_cast<std::size_t>(i)] == RgbD{}))
              add(i, -light[static_cast<std::size_t>(i)]);
          }
          break;
        case 4:
          sums.expect_resets(random() % 2);
          break;
        default: {  // moved to another place
          RowSums moved = std::move(sums);
          sums = std::move(moved);
        }
      }
      judge.count(sums.apply(update));
      for (int i = 0; i < layout.size(); ++i) {
        if (update.reset[static_cast<std::size_t>(layout.band_of(i))])
          light[static_cast<std::size_t>(i)] = {};
      }
      for (const WaveletDelta& d : update.deltas)
        light[static_cast<std::size_t>(d.index)] += d.delta;
      ++done;
      const double of_bound = judge.of_bound(outputs(sums), light, false);
      worst = std::max(worst, of_bound);
      RC_ASSERT(of_bound <= 1);
      if (std::all_of(light.begin(), light.end(), [](const RgbD& c) { return c == RgbD{}; })) {
        dark += not_zero_bits(sums.totals());
        RC_ASSERT(not_zero_bits(sums.totals()) == 0);
      }
    }
  });
  at_least("operations", done, 100.0 * kSequence);
  at_most("of bound A", worst, 1);
  at_most("sums that are not +0 in the dark", dark, 0);
}

// The same with bands long enough to be folded into kept pictures.
TEST(HardCases, Row04_FoldedBands) {
  property("bands folded into kept pictures and reset again meet bound A");
  const fixtures::SmallTransport small = fixtures::small_transport(8, 64, 64, 11);
  const HaarLayout layout(8);
  RowSums sums(build_transport(small.info, small.tiles, small.thresholds));
  const auto plain_bytes = static_cast<double>(sums.extra_bytes());
  Judge judge(small);
  std::vector<RgbD> light(static_cast<std::size_t>(layout.size()));
  std::mt19937 random(12);
  double worst = 0, folded = 0;
  const int count = full() ? 4000 : 240;
  for (int step = 0; step < count; ++step) {
    LightingUpdate update;
    for (std::size_t b = 0; b < static_cast<std::size_t>(layout.band_count()); ++b) {
      update.reset[b] = random() % 6 == 0;
    }
    for (int i = 0; i < layout.size(); ++i) {
      const auto j = static_cast<std::size_t>(i);
      if (update.reset[static_cast<std::size_t>(layout.band_of(i))]) light[j] = {};
      if (random() % 3 != 0) continue;
      update.deltas.push_back({i, RgbD(color_of(random))});
      light[j] += update.deltas.back().delta;
    }
    judge.count(sums.apply(update));
    const double pictures = (static_cast<double>(sums.extra_bytes()) - plain_bytes) /
                            (static_cast<double>(sums.totals().size()) * sizeof(double));
    folded = std::max(folded, std::floor(pictures));
    if (step % 8 == 0) worst = std::max(worst, judge.of_bound(outputs(sums), light, false));
  }
  at_least("kept pictures", folded, 1);
  at_most("of bound A", worst, 1);
}

LightingOptions random_options(const HaarLayout& layout, std::mt19937& random) {
  LightingOptions options;
  options.method = kMethods[random() % 4];
  options.wavelets = 1 + static_cast<int>(random() % 40);
  options.band_choice = random() % 4 ? BandChoice::simple : BandChoice::exhaustive;
  if (random() % 3 == 0) {
    for (int i = 0; i < layout.size(); ++i) {
      options.weights.push_back(static_cast<float>(1 + random() % 3));
    }
  }
  return options;
}

// Everything a program does to a tracker, with all consumers following it.
TEST(HardCases, Row04_TrackersAndRelighters) {
  property("any operations on a tracker: updates are those of a slow one; every relighter follows");
  const fixtures::SmallTransport small = fixtures::small_transport(4, 8, 8, 2);
  const fixtures::SmallTransport mesh =
      fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(20, 3), 4);
  const Transport image_transport = build_transport(small.info, small.tiles, small.thresholds);
  const Transport mesh_transport = build_transport(mesh.info, mesh.tiles, mesh.thresholds);
  const TemporaryFolder folder;
  fixtures::SmallTransport shiny = fixtures::smooth_transport(4, 20, 2, true, -0.8);
  shiny.info.view = std::make_shared<const ViewFactors>(
      fixtures::random_view_factors(shiny.info.mesh->position.size(), 2, 5));
  compress_transport(build_transport(shiny.info, shiny.tiles, shiny.thresholds), folder / "c.hlt",
                     {.clusters = 4, .basis = 4});
  const Transport cluster_transport = Transport::open(folder / "c.hlt");
  const HaarLayout layout(4);
  double done = 0, sums_worst = 0, image_worst = 0, mesh_worst = 0, cluster_worst = 0, arrived = 0,
         behind = 0;
  rc::detail::checkGTest([&] {
    const auto sequence = *operations(10);
    LightingTracker tracker(layout, {});
    SlowTracker slow(layout, {});
    RowSums sums(image_transport);
    ImageRelighter image(image_transport);
    MeshRelighter vertices(mesh_transport);
    // One follows all vectors in every frame, the other two of them; that one is held to what is
    // shown when it says that it has arrived.
    ClusterRelighter clusters(cluster_transport, {.basis_terms = -1, .skip_unseen = false});
    ClusterRelighter slower(cluster_transport, {.basis_terms = 2, .skip_unseen = false});
    ClusterJudge cluster_judge(cluster_transport);
    const std::size_t round = static_cast<std::size_t>(done) / kSequence, step = row_step();
    Judge sums_judge(small, round, step), image_judge(small, round, step),
        mesh_judge(mesh, round, step);
    std::vector<Rgb> target(static_cast<std::size_t>(layout.size()));
    LightingOptions options;
    const auto follow = [&](const LightingUpdate& update) {
      sums_judge.count(sums.apply(update));
      image_judge.count(image.apply(update).apply);
      mesh_judge.count(vertices.apply(update).apply);
      cluster_judge.count(clusters.apply(update).apply);
      slower.apply(update);
    };
    for (const Operation& operation : sequence) {
      std::mt19937 random(operation.seed);
      bool exact = false;
      switch (operation.kind) {
        case 0:  // a few coefficients move
          for (int i = 0; i < 5; ++i) target[random() % target.size()] = color_of(random);
          break;
        case 1:  // another light
          for (Rgb& c : target) c = random() % 3 ? color_of(random) : Rgb{};
          break;
        case 2:  // the light stands still
          break;
        case 3:  // lights out
          std::fill(target.begin(), target.end(), Rgb{});
          break;
        case 4: {  // a sun on or off
          std::vector<Rgb> texels(target.size());
          haar_inverse(layout, std::span<const Rgb>(target), std::span<Rgb>(texels));
          Rgb& texel = texels[random() % texels.size()];
          texel = texel.r > 1e5f ? Rgb{1, 1, 1} : Rgb{1e6f, 1e6f, 1e6f};
          haar_forward(layout, std::span<const Rgb>(texels), std::span<Rgb>(target));
          break;
        }
        case 5:  // method, budget, weights, band choice
          options = random_options(layout, random);
          tracker.set_options(options);
          slow.set_options(options);
          sums.expect_resets(options.method == LightingMethod::pbi);
          clusters.expect_resets(options.method == LightingMethod::pbi);
          slower.set_exact(random() % 4 == 0);
          break;
        case 6:
          exact = true;
          break;
        case 7: {  // refused, and nothing changes
          std::vector<Rgb> bad = target;
          bad[random() % bad.size()].g = random() % 2 ? std::numeric_limits<float>::quiet_NaN()
                                                      : std::numeric_limits<float>::infinity();
          RC_ASSERT_THROWS_AS(tracker.advance(bad), Error);
          LightingOptions wrong = options;
          wrong.wavelets = 0;
          RC_ASSERT_THROWS_AS(tracker.set_options(wrong), Error);
          break;
        }
        case 8:  // the whole sky the other way round
          for (Rgb& c : target) c = -c;
          break;
        default:  // one band
          for (int i = layout.band(1).begin; i < layout.band(1).end; ++i) {
            target[static_cast<std::size_t>(i)] = color_of(random);
          }
      }
      const bool searches = !exact && options.method == LightingMethod::pbi &&
                            options.band_choice == BandChoice::exhaustive;
      double least = HUGE_VAL, left = 0;
      if (searches) {
        for (unsigned mask = 0; mask < 1u << layout.band_count(); ++mask) {
          least = std::min(least, slow.combination_error(target, BandMask(mask)));
        }
      }
      const LightingUpdate& update = exact ? tracker.start_exact(target) : tracker.advance(target);
      if (searches) {
        left = slow.combination_error(target, update.reset);
        // The search takes the largest keys off the sum of all: some v of that.
        double all = 0;
        for (std::size_t i = 0; i < target.size(); ++i) {
          all += 100 * static_cast<double>(l1_norm(target[i]) + l1_norm(slow.shown()[i]));
        }
        RC_ASSERT(left <= least * (1 + 1e-5) + 1e-14 * all);
      }
      const LightingUpdate right =
          exact ? slow.start_exact(target) : slow.advance(target, update.reset);
      RC_ASSERT(update == right);
      RC_ASSERT(std::equal(slow.shown().begin(), slow.shown().end(), tracker.shown().begin()));
      follow(update);
      ++done;
      const double a = sums_judge.of_bound(outputs(sums), tracker.shown(), false);
      const double b = image_judge.of_bound(doubles(image.picture().pixels), tracker.shown(), true);
      const double c = mesh_judge.of_bound(doubles(vertices.radiance()), tracker.shown(), true);
      sums_worst = std::max(sums_worst, a), image_worst = std::max(image_worst, b);
      mesh_worst = std::max(mesh_worst, c);
      cluster_judge.look(tracker.shown());
      double d = cluster_judge.of_bound(clusters.sums());
      ++(slower.settled() ? arrived : behind);
      if (slower.settled()) d = std::max(d, cluster_judge.of_bound(slower.sums()));
      cluster_worst = std::max(cluster_worst, d);
      RC_ASSERT(a <= 1 && b <= 1 && c <= 1 && d <= 1);
    }
  });
  at_least("operations", done, 100.0 * kSequence);
  at_most("sums: of bound A", sums_worst, 1);
  at_most("pictures: of their bound", image_worst, 1);
  at_most("meshes: of their bound", mesh_worst, 1);
  at_most("clusters: of their bound", cluster_worst, 1);
  at_least("frames with all of two vectors at a time", arrived, 1000);
  at_least("frames on the way there", behind, 1000);
}

}  // namespace
}  // namespace haarlight
