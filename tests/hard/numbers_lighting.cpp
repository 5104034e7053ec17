// Rows 1 to 12: what the light does to running sums, selection and the gate.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "core/error.h"
#include "prt/image_relighter.h"
#include "prt/motion.h"
#include "prt/tonemap.h"
#include "tests/hard/hard_case.h"
#include "tests/hard/oracle.h"

namespace haarlight {
namespace {

using namespace hard;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::vector<double> totals_of(const RowSums& sums) {
  return {sums.totals().begin(), sums.totals().end()};
}

double bits_changed(const std::vector<double>& a, const std::vector<double>& b) {
  double changed = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    changed += std::bit_cast<std::uint64_t>(a[i]) != std::bit_cast<std::uint64_t>(b[i]);
  }
  return changed;
}

Image even_picture(int width, int height, const Rgb& value) {
  Image image(width, height);
  std::fill(image.pixels.begin(), image.pixels.end(), value);
  return image;
}

// A sky of some texture, the same every time.
Image textured_sky() {
  Image image(64, 32);
  std::mt19937_64 random(77);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (Rgb& p : image.pixels) p = {uniform(random), uniform(random), 2 * uniform(random)};
  return image;
}

TEST(HardCases, Row01_SunToggledTenThousandTimes) {
  property("a sun of 1e6 switched on and off 10,000 times leaves at most 1e-7 in a unit picture");
  // Rows add up to 1, as those of a white surface do: a sky of 1 is a picture of 1. Bound A with
  // K = 10,000 x 2 x 30 columns, S = 1e6 x the texel's share: 6e5 v 1e6 / 384 = 2e-7 at worst; as
  // roundings have both signs, sqrt(K) instead of K and 1e-9 are to be expected.
  const HaarLayout layout(8);
  std::mt19937_64 random(22);
  fixtures::SmallTransport small = fixtures::small_transport(8, 8, 8, 21);
  small.tiles[0] = fixtures::unit_tile(layout, random);
  std::uniform_real_distribution<float> uniform(0.5f, 1.5f);
  std::vector<Rgb> sky(static_cast<std::size_t>(layout.size()));
  for (Rgb& c : sky) c = {uniform(random), uniform(random), uniform(random)};
  // The sky moves on while the sun comes and goes: rounded deltas of a sun that came over one sky
  // and went over another do not cancel.
  std::vector<std::vector<Rgb>> dim, sunny;
  for (int i = 0; i < 7; ++i) {
    const float share = 1 + 0.013f * static_cast<float>(i);
    dim.push_back(lighting_of(layout, [&](std::size_t k) { return sky[k] * share; }));
    sunny.push_back(lighting_of(layout, [&](std::size_t k) {
      return k == 100 ? Rgb{1e6f, 1e6f, 1e6f} * share : sky[k] * share;
    }));
  }
  double residue = 0, of_bound = 0;
  for (const LightingMethod method :
       {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi, LightingMethod::reference}) {
    Chain chain(small, options_of(method, 30));
    chain.start(dim[0]);
    for (int toggle = 0; toggle < 10000; ++toggle) {
      chain.advance(sunny[static_cast<std::size_t>(toggle % 7)]);
      if (toggle < 7) chain.drift();  // the peak S
      chain.advance(dim[static_cast<std::size_t>(toggle * 3 % 7)]);
    }
    for (int frame = 0; frame < 20; ++frame) chain.advance(dim[0]);
    const Chain::Drift drift = chain.drift();
    residue = std::max(residue, drift.largest);
    of_bound = std::max(of_bound, drift.of_bound);
  }
  at_most("residue", residue, 1e-7);
  at_most("of bound A", of_bound, 1);
}

TEST(HardCases, Row02_DriftOfManyFrames) {
  property("|B - T L~| <= (K + 2n) v S after many frames, and <= 1e-12 S");
  // 1e-12 is 30 times the random walk sqrt(K) v = 1e-13 of K = 30 x 20,000 updates.
  const fixtures::SmallTransport small = small_case(2);
  const HaarLayout layout(8);
  std::mt19937_64 random(3);
  double of_peak = 0, of_bound = 0;
  for (const LightingMethod method : {LightingMethod::bi, LightingMethod::pbi}) {
    Chain chain(small, options_of(method, 30));
    auto target = fixtures::random_lighting(layout, random);
    chain.start(target);
    for (int frame = 0; frame < 20000; ++frame) {
      for (int i = 0; i < 20; ++i) {
        const float size = frame % 50 == 0 ? 1000.0f : 1.0f;
        std::uniform_real_distribution<float> uniform(-size, size);
        target[random() % target.size()] = {uniform(random), uniform(random), uniform(random)};
      }
      chain.advance(target);
      if (frame % 500 == 0 || frame == 19999) {
        const Chain::Drift drift = chain.drift();
        of_peak = std::max(of_peak, drift.of_peak);
        of_bound = std::max(of_bound, drift.of_bound);
      }
    }
  }
  at_most("of S", of_peak, 1e-12);
  at_most("of bound A", of_bound, 1);
}

TEST(HardCases, Row03_LightStops) {
  property(
      "exact after size / budget frames of still light, then no bit changes in 100,000 frames");
  const fixtures::SmallTransport small = small_case(4);
  const HaarLayout layout(8);
  std::mt19937_64 random(5);
  double of_bound = 0, wrong = 0, changed = 0;
  for (const LightingMethod method : {LightingMethod::bi, LightingMethod::pbi}) {
    Chain chain(small, options_of(method, 30));
    chain.start(fixtures::random_lighting(layout, random));
    for (int frame = 0; frame < 40; ++frame) {
      chain.advance(fixtures::random_lighting(layout, random));
      chain.drift();
    }
    // It comes to rest by the least a float can move: that, too, must be shown.
    auto rest = fixtures::random_lighting(layout, random);
    for (int frame = 0; frame < (layout.size() + 29) / 30; ++frame) chain.advance(rest);
    for (Rgb& c : rest) {
      if (c.g != 0) c.g = std::nextafter(c.g, 1000.0f);
    }
    for (int frame = 0; frame < (layout.size() + 29) / 30; ++frame) chain.advance(rest);
    for (std::size_t i = 0; i < rest.size(); ++i) wrong += !(chain.tracker.shown()[i] == rest[i]);
    of_bound = std::max(of_bound, chain.drift().of_bound);
    const auto before = totals_of(chain.sums);
    for (int frame = 0; frame < 100000; ++frame) chain.advance(rest);
    changed += bits_changed(before, totals_of(chain.sums));
  }
  at_most("coefficients not exact", wrong, 0);
  at_most("of bound A", of_bound, 1);
  at_most("sums changed", changed, 0);
}

TEST(HardCases, Row05_LightsOut) {
  property("when nothing is shown every sum is +0, bit for bit");
  const fixtures::SmallTransport small = small_case(6);
  const HaarLayout layout(8);
  std::mt19937_64 random(7);
  const std::vector<Rgb> dark(static_cast<std::size_t>(layout.size()));
  double nonzero = 0, relit = 0;
  for (const LightingMethod method : kMethods) {
    for (int band = -1; band < layout.band_count(); ++band) {  // -1: light in all bands
      Chain chain(small, options_of(method, 100));
      for (int round = 0; round < 3; ++round) {
        for (int frame = 0; frame < 6; ++frame) {
          auto target = fixtures::random_lighting(layout, random);
          for (int i = 0; i < layout.size(); ++i) {
            // A wide range: products of 8 bits with floats of one size would add without rounding.
            if (random() % 4 == 0) target[static_cast<std::size_t>(i)] *= 3e-7f;
            if (band >= 0 && layout.band_of(i) != band) target[static_cast<std::size_t>(i)] = {};
          }
          chain.advance(target);
        }
        for (int frame = 0; frame < 4; ++frame) chain.advance(dark);
        for (const double total : chain.sums.totals()) {
          nonzero += std::bit_cast<std::uint64_t>(total) != 0;
        }
        // And what is lit again afterwards is right.
        chain.start(fixtures::random_lighting(layout, random));
        relit = std::max(relit, chain.drift().of_bound);
      }
    }
  }
  at_most("sums that are not +0", nonzero, 0);
  at_most("relit: of bound A", relit, 1);
}

TEST(HardCases, Row06_NanTexel) {
  property(
      "a NaN texel is counted and dark; one in a target is refused and the next frame is right");
  const fixtures::SmallTransport small = small_case(8);
  const HaarLayout layout(8);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  Image broken = textured_sky(), mended = broken;
  broken.at(40, 10).g = kNan;
  broken.at(12, 20) = {kInfinity, 1, -kInfinity};
  mended.at(40, 10) = mended.at(12, 20) = {};
  const Environment a(broken), b(mended);
  at_least("NaN and Inf pixels counted", static_cast<double>(a.report().not_finite_pixels), 2);

  // From the gate to the picture: the same bits as with those pixels black.
  double different = 0, not_finite = 0;
  const MotionOptions rotate{.kind = MotionKind::rotate, .degrees = 90, .stop = 20};
  Motion motion_a(rotate, layout, a), motion_b(rotate, layout, b);
  LightingTracker tracker_a(layout, {}), tracker_b(layout, {});
  ImageRelighter picture_a(transport), picture_b(transport);
  for (int frame = 0; frame < 25; ++frame) {
    picture_a.apply(tracker_a.advance(motion_a.coefficients(frame)));
    picture_b.apply(tracker_b.advance(motion_b.coefficients(frame)));
    for (std::size_t i = 0; i < picture_a.picture().pixels.size(); ++i) {
      different += !(picture_a.picture().pixels[i] == picture_b.picture().pixels[i]);
      not_finite += !is_finite(picture_a.picture().pixels[i]);
    }
  }
  at_most("pixels that differ from the mended sky's", different, 0);
  at_most("pixels that are not finite", not_finite, 0);

  // Past the gate: refused, and nothing of it stays.
  std::mt19937_64 random(9);
  double accepted = 0, of_bound = 0, chosen_wrong = 0;
  Chain chain(small, options_of(LightingMethod::pbi, 30));
  chain.start(fixtures::random_lighting(layout, random));
  for (int frame = 0; frame < 20; ++frame) {
    auto target = fixtures::random_lighting(layout, random);
    auto poisoned = target;
    (frame % 2 ? poisoned[random() % poisoned.size()].b : poisoned[0].r) =
        frame % 3 ? kNan : -kInfinity;
    try {
      chain.advance(poisoned);
      ++accepted;
    } catch (const Error&) {
    }
    chain.advance(target);
    of_bound = std::max(of_bound, chain.drift().of_bound);
    // NaN keys disturb no order: the choice is that of the other keys.
    std::vector<float> keys, clean;
    for (std::size_t i = 0; i < target.size(); ++i) {
      keys.push_back(random() % 5 ? l1_norm(target[i]) : kNan);
      clean.push_back(std::isnan(keys.back()) ? 0 : keys.back());
    }
    std::vector<int> with, without;
    TopK().select(keys, 40, with);
    TopK().select(clean, 40, without);
    chosen_wrong += with != without;
  }
  at_most("NaN targets accepted", accepted, 0);
  at_most("next frame: of bound A", of_bound, 1);
  at_most("choices disturbed by NaN keys", chosen_wrong, 0);
}

TEST(HardCases, Row07_HugeRadiance) {
  property("radiance up to 1.8e18 is relit within bound A and finite; more is refused at the gate");
  // 1.8e18 everywhere makes scaling coefficients n x 1.8e18; their squares are beyond floats, and
  // nothing may square them as floats.
  const fixtures::SmallTransport small = small_case(10);
  const HaarLayout layout(8);
  Image bright = even_picture(64, 32, {1.79e18f, 1.79e18f, 1.79e18f});
  Image mixed = textured_sky();
  for (std::size_t i = 0; i < mixed.pixels.size(); i += 7) mixed.pixels[i] *= 0.9e18f;
  double of_bound = 0, not_finite = 0;
  for (const Image& sky : {bright, mixed}) {
    const Environment environment(sky);
    Motion motion({.kind = MotionKind::tumble, .degrees = 90, .stop = 10}, layout, environment);
    for (const LightingMethod method : kMethods) {
      Chain chain(small, options_of(method, 30));
      ImageRelighter picture(chain.sums.transport());
      for (int frame = 0; frame < 12; ++frame) {
        const auto target = motion.coefficients(frame);
        const LightingUpdate update =
            frame ? chain.tracker.advance(target) : chain.tracker.start_exact(target);
        chain.apply(update);
        picture.apply(update);
        of_bound = std::max(of_bound, chain.drift().of_bound);
        for (const Rgb& p : picture.picture().pixels) not_finite += !is_finite(p);
        not_finite += !std::isfinite(lighting_error(layout, chain.tracker.shown(), target));
      }
    }
  }
  at_most("of bound A", of_bound, 1);
  at_most("pixels and errors that are not finite", not_finite, 0);
  double accepted = 0;
  for (const float value : {2e18f, 1e38f, 3.4e38f}) {
    Image image = even_picture(64, 32, {1, 1, 1});
    image.at(3, 3).g = value;
    try {
      const Environment environment(image);
      ++accepted;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::format);
    }
  }
  at_most("larger values accepted", accepted, 0);
}

TEST(HardCases, Row08_NegativeLight) {
  property("B(-L) = -B(L) bit for bit: nothing but the display clamps");
  const fixtures::SmallTransport small = small_case(11);
  const HaarLayout layout(8);
  std::mt19937_64 random(12);
  double different = 0, negative = 0, shown_negative = 0;
  for (const LightingMethod method : kMethods) {
    Chain plus(small, options_of(method, 30)), minus(small, options_of(method, 30));
    ImageRelighter picture_plus(plus.sums.transport()), picture_minus(minus.sums.transport());
    for (int frame = 0; frame < 40; ++frame) {
      const auto target = fixtures::random_lighting(layout, random);
      std::vector<Rgb> opposite;
      for (const Rgb& c : target) opposite.push_back(-c);
      const LightingUpdate& a = plus.tracker.advance(target);
      const LightingUpdate& b = minus.tracker.advance(opposite);
      plus.apply(a), minus.apply(b);
      picture_plus.apply(a), picture_minus.apply(b);
      for (std::size_t i = 0; i < plus.sums.totals().size(); ++i) {
        different += plus.sums.totals()[i] != -minus.sums.totals()[i];
      }
      for (std::size_t i = 0; i < picture_plus.picture().pixels.size(); ++i) {
        const Rgb& p = picture_plus.picture().pixels[i];
        different += !(p == -picture_minus.picture().pixels[i]);
        negative += p.r < 0;
      }
      for (const Rgb& p : tonemap(picture_plus.picture(), {}).pixels) {
        shown_negative += !(p.r >= 0 && p.g >= 0 && p.b >= 0);
      }
    }
  }
  at_most("sums and pixels that differ", different, 0);
  at_least("negative pixels met", negative, 1000);
  at_most("negative pixels displayed", shown_negative, 0);
}

TEST(HardCases, Row10_AllBlack) {
  property("black light: no NaN anywhere, no update, no reset, after light and from the start");
  const fixtures::SmallTransport small = small_case(13);
  const HaarLayout layout(8);
  std::mt19937_64 random(14);
  const Environment black(even_picture(64, 32, {}));
  double updates = 0, bad = 0;
  for (const LightingMethod method : kMethods) {
    for (const BandChoice choice : {BandChoice::simple, BandChoice::exhaustive}) {
      LightingOptions options = options_of(method, 30);
      options.band_choice = choice;
      Motion motion({.kind = MotionKind::rotate, .degrees = 90, .stop = 5}, layout, black);
      LightingTracker tracker(layout, options);
      ImageRelighter relighter(build_transport(small.info, small.tiles, small.thresholds));
      for (int frame = 0; frame < 30; ++frame) {
        // Ten black frames, ten of light, ten black ones (of which the first takes light away).
        const bool lit = frame >= 10 && frame < 20;
        const auto light = lit ? fixtures::random_lighting(layout, random) : std::vector<Rgb>{};
        const std::span<const Rgb> target = lit ? light : motion.coefficients(frame);
        const LightingUpdate& update = tracker.advance(target);
        relighter.apply(update);
        if (frame < 10 || frame > 23) {
          updates += static_cast<double>(update.deltas.size());
          // nwa resets all bands by definition; the others have nothing to reset.
          if (method != LightingMethod::nwa) updates += static_cast<double>(update.reset.count());
        }
        bad += !std::isfinite(lighting_error(layout, tracker.shown(), target));
        for (const Rgb& p : relighter.picture().pixels) {
          bad += !is_finite(p);
          if (frame < 10 || frame > 23) bad += !(p == Rgb{});
        }
      }
    }
  }
  at_most("updates and resets under black", updates, 0);
  at_most("values that are NaN, or light in the dark", bad, 0);
}

TEST(HardCases, Row12_SingleTexel) {
  property(
      "one texel has 3 log2 R + 1 coefficients; a budget of that many shows it exactly, of fewer "
      "that many");
  double wrong = 0, of_bound = 0, missed = 0, not_of_budget = 0;
  std::mt19937_64 random(16);
  for (const int n : {8, 16, 64, 256}) {
    const HaarLayout layout(n);
    const double levels = std::log2(n);
    for (int trial = 0; trial < 5; ++trial) {
      const std::size_t lit = random() % static_cast<std::size_t>(layout.size());
      const auto light = lighting_of(layout, [&](std::size_t k) {
        return k == lit ? Rgb{1e5f, 7, 1e-3f} : Rgb{};
      });
      double nonzero = 0;
      for (const Rgb& c : light) nonzero += !(c == Rgb{});
      wrong += nonzero != 3 * levels + 1;
    }
  }
  const fixtures::SmallTransport small = small_case(15);
  const HaarLayout layout(8);
  Chain chain(small, options_of(LightingMethod::nwa, 10));  // 3 x 3 + 1
  for (std::size_t lit = 0; lit < static_cast<std::size_t>(layout.size()); lit += 5) {
    const auto light = lighting_of(layout, [&](std::size_t k) {
      return k == lit ? Rgb{5, 6, 7} : Rgb{};
    });
    chain.advance(light);
    for (std::size_t i = 0; i < light.size(); ++i)
      missed += !(chain.tracker.shown()[i] == light[i]);
    of_bound = std::max(of_bound, chain.drift().of_bound);
  }
  for (int budget = 1; budget <= 9; ++budget) {
    Chain few(small, options_of(LightingMethod::nwa, budget));
    few.advance(lighting_of(layout, [](std::size_t k) { return k == 77 ? Rgb{5, 6, 7} : Rgb{}; }));
    int shown = 0;
    for (const Rgb& c : few.tracker.shown()) shown += !(c == Rgb{});
    not_of_budget += shown != budget;
  }
  at_most("texels with another number", wrong, 0);
  at_most("coefficients not shown", missed, 0);
  at_most("budgets not kept to", not_of_budget, 0);
  at_most("of bound A", of_bound, 1);
}

TEST(HardCases, Row11_ConstantLight) {
  property("a constant sky has one coefficient a face, however it is turned: no details of noise");
  double details = 0;
  float uneven = 0;
  for (const int n : {8, 16, 64}) {
    const HaarLayout layout(n);
    for (const float value : {0.3f, 1.0f, 7.7e5f}) {
      const Environment environment(even_picture(128, 64, {value, 0.5f * value, value}));
      Motion motion({.kind = MotionKind::tumble, .degrees = 90, .stop = 9}, layout, environment);
      for (int frame = 0; frame < 10; ++frame) {
        const auto light = motion.coefficients(frame);
        for (std::size_t i = 6; i < light.size(); ++i) {
          details += !(light[i] == Rgb{});
          uneven = std::max(uneven, std::abs(light[i].r) / value);
        }
      }
    }
  }
  at_most("details", details, 0);
  at_most("largest detail", static_cast<double>(uneven), 0);
}

}  // namespace
}  // namespace haarlight
