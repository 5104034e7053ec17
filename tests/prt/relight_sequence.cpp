// A sequence's pictures and metrics against the same things computed the slow way.

#include "prt/relight_sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/image_relighter.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

constexpr int kFace = 8, kBands = 3;

/// Lat-long light with a lamp, from a seed.
Environment random_environment(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  Image picture(32, 16);
  for (Rgb& pixel : picture.pixels) pixel = {uniform(random), uniform(random), uniform(random)};
  picture.at(20, 5) = {40, 30, 20};
  return Environment(picture);
}

Transport random_transport() {
  const fixtures::SmallTransport small = fixtures::small_transport(kFace, 24, 16, 5);
  return build_transport(small.info, small.tiles, small.thresholds);
}

SequenceOptions short_sequence(LightingMethod method) {
  SequenceOptions options;
  options.lighting.method = method;
  options.lighting.wavelets = 40;
  options.motion.stop = 8;
  options.frames = 14;
  return options;
}

TEST(RelightSequence, WeightsAreWhatTheirNamesSay) {
  const Transport transport = random_transport();
  EXPECT_EQ(wavelet_weights(WaveletWeight::none, transport),
            std::vector<float>(6 * kFace * kFace, 1.0f));
  EXPECT_EQ(wavelet_weights(WaveletWeight::area, transport), area_weights(transport.layout()));
  const auto norms = transport.column_norms();
  EXPECT_EQ(wavelet_weights(WaveletWeight::transport, transport),
            std::vector<float>(norms.begin(), norms.end()));
  for (const char* name : {"none", "area", "transport"}) {
    const auto weight = wavelet_weight_from_name(name);
    ASSERT_TRUE(weight.has_value());
    EXPECT_EQ(wavelet_weight_name(*weight), name);
  }
  EXPECT_FALSE(wavelet_weight_from_name("size").has_value());
}

TEST(RelightSequence, MetricsAreThoseOfTheTrackerAndTheTwoPictures) {
  const int before = thread_count();
  set_thread_count(1);  // hundreds of tiny frames: starting threads would be most of the work
  const Transport transport = random_transport();
  const Environment light = random_environment(1);
  for (const LightingMethod method :
       {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi, LightingMethod::reference}) {
    for (const WaveletWeight weight :
         {WaveletWeight::none, WaveletWeight::area, WaveletWeight::transport}) {
      for (const bool from_dark : {false, true}) {
        SCOPED_TRACE(lighting_method_name(method) + " " + wavelet_weight_name(weight));
        SequenceOptions options = short_sequence(method);
        options.weight = weight;
        options.from_dark = from_dark;
        options.against_reference = true;

        // The deciding half once more, beside the sequence.
        LightingOptions lighting = options.lighting;
        lighting.weights = wavelet_weights(weight, transport);
        LightingTracker tracker(transport.layout(), lighting);
        Motion motion(options.motion, transport.layout(), light);
        int frames = 0;
        relight_sequence(transport, light, nullptr, options, [&](const SequenceFrame& frame) {
          const FrameMetrics& m = frame.metrics;
          EXPECT_EQ(m.frame, frames);
          const std::span<const Rgb> target = motion.coefficients(frames);
          EXPECT_TRUE(
              std::equal(target.begin(), target.end(), frame.target.begin(), frame.target.end()));
          const LightingUpdate update =
              frames == 0 && !from_dark ? tracker.start_exact(target) : tracker.advance(target);
          EXPECT_EQ(m.updates, static_cast<int>(update.deltas.size()));
          EXPECT_EQ(m.resets.size(), static_cast<std::size_t>(kBands));
          for (std::size_t b = 0; b < m.resets.size(); ++b) {
            EXPECT_EQ(m.resets[b], update.reset[b] ? '1' : '0');
          }
          EXPECT_EQ(m.lighting_error, lighting_error(transport.layout(), tracker.shown(), target));
          EXPECT_EQ(m.wavelets, method == LightingMethod::reference ? 6 * kFace * kFace : 40);
          EXPECT_EQ(m.bytes == 0, update.empty());

          // Pictures against single products; both are sums in double rounded to float, of entries
          // below 0.1 and up to 384 coefficients of at most a few hundred: 1e-5 is far above.
          if (frames % 5 == 3) {
            const Image shown = relight_once(transport, tracker.shown());
            const Image exact = relight_once(transport, target);
            for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
              EXPECT_LT(l1_norm(frame.picture.pixels[i] - shown.pixels[i]), 1e-5);
              EXPECT_LT(l1_norm(frame.reference->pixels[i] - exact.pixels[i]), 1e-5);
            }
          }
          double difference = 0, power = 0, largest = 0;
          for (std::size_t i = 0; i < frame.picture.pixels.size(); ++i) {
            const RgbD a(frame.picture.pixels[i]), b(frame.reference->pixels[i]), d = a - b;
            difference += d.r * d.r + d.g * d.g + d.b * d.b;
            power += b.r * b.r + b.g * b.g + b.b * b.b;
            largest = std::max({largest, std::abs(d.r), std::abs(d.g), std::abs(d.b)});
          }
          EXPECT_NEAR(*m.image_rel_rmse, std::sqrt(difference / power), 1e-12);
          EXPECT_NEAR(*m.image_max_abs, largest, 1e-12);

          EXPECT_GE(m.total_ms, m.update_ms);
          EXPECT_GE(m.apply_ms, 0);
          EXPECT_GE(m.finish_ms, 0);
          ++frames;
          return true;
        });
        EXPECT_EQ(frames, options.frames);
      }
    }
  }
  set_thread_count(before);
}

TEST(RelightSequence, WithoutAReferenceNothingIsMeasuredAgainstOne) {
  const Transport transport = random_transport();
  relight_sequence(transport, random_environment(2), nullptr, short_sequence(LightingMethod::pbi),
                   [](const SequenceFrame& frame) {
                     EXPECT_EQ(frame.reference, nullptr);
                     EXPECT_FALSE(frame.metrics.image_rel_rmse.has_value());
                     EXPECT_FALSE(frame.metrics.image_max_abs.has_value());
                     return true;
                   });
}

TEST(RelightSequence, TheSameBitsOnAnyNumberOfThreads) {
  const Transport transport = random_transport();
  const Environment light = random_environment(3);
  const int before = thread_count();
  std::vector<std::vector<Rgb>> pictures[2];
  std::vector<double> errors[2];
  for (int run = 0; run < 2; ++run) {
    set_thread_count(run == 0 ? 1 : 7);
    relight_sequence(transport, light, nullptr, short_sequence(LightingMethod::pbi),
                     [&](const SequenceFrame& frame) {
                       pictures[run].push_back(frame.picture.pixels);
                       errors[run].push_back(frame.metrics.lighting_error);
                       return true;
                     });
  }
  set_thread_count(before);
  EXPECT_EQ(pictures[0], pictures[1]);
  EXPECT_EQ(errors[0], errors[1]);
}

TEST(RelightSequence, StopsWhenAskedTo) {
  const Transport transport = random_transport();
  int frames = 0;
  try {
    relight_sequence(transport, random_environment(4), nullptr, short_sequence(LightingMethod::bi),
                     [&](const SequenceFrame&) { return ++frames < 3; });
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::cancelled);
  }
  EXPECT_EQ(frames, 3);
}

TEST(RelightSequence, RefusesWhatCannotBeRun) {
  const Transport transport = random_transport();
  const Environment light = random_environment(5);
  const auto kind_of = [&](const SequenceOptions& options) {
    try {
      relight_sequence(transport, light, nullptr, options, {});
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::cancelled;
  };
  SequenceOptions none = short_sequence(LightingMethod::pbi);
  none.frames = 0;
  EXPECT_EQ(kind_of(none), ErrorKind::invalid_argument);
  SequenceOptions blend = short_sequence(LightingMethod::pbi);
  blend.motion.kind = MotionKind::blend;
  EXPECT_EQ(kind_of(blend), ErrorKind::invalid_argument);
  SequenceOptions broke = short_sequence(LightingMethod::pbi);
  broke.lighting.wavelets = 0;
  EXPECT_EQ(kind_of(broke), ErrorKind::invalid_argument);
}

}  // namespace
}  // namespace haarlight
