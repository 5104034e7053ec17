// Options of the caching methods of haarlight animate.

#include "apps/caching_options.h"

#include "apps/option_parsers.h"

namespace haarlight {

void add_caching_options(CLI::App& verb, CachingOptions& options) {
  constexpr double kMostPixels = 1000;
  CachingOptions& o = options;
  add_number(verb, "--accuracy", o.accuracy, 0.01, 1,
             "irc, trc: largest error of using a record at another place (Ward's a)");
  add_number(verb, "--min-spacing", o.least_spacing, 0.5, kMostPixels,
             "irc, trc: a record reaches at least so far, pixels");
  add_number(verb, "--max-spacing", o.most_spacing, 0.5, kMostPixels,
             "irc, trc: and at most so far, pixels");
  add_integer(verb, "--hemisphere-samples", o.hemisphere_samples, 8, 1 << 16,
              "irc, trc: directions of a record");
  add_integer(verb, "--direct-samples", o.direct_samples, 1, 1 << 12,
              "irc, trc: looks at shining triangles, a pixel");
  add_integer(verb, "--glossy-samples", o.glossy_samples, 1, 1 << 12,
              "irc, trc: rays of a narrow lobe, a pixel");
  add_choice<TemporalGradients>(verb, "--gradients", o.gradients,
                                {{"none", TemporalGradients::none},
                                 {"extrapolated", TemporalGradients::extrapolated},
                                 {"interpolated", TemporalGradients::interpolated}},
                                "trc: how records change while they are used; interpolated: two "
                                "passes, no jumps");
  add_number(verb, "--temporal-accuracy", o.age.accuracy, 1e-4, 100,
             "trc: relative change of light that a record may miss");
  add_integer(verb, "--max-lifespan", o.age.longest, 1, 100000,
              "trc: frames after which a record is replaced anyhow");
  verb.add_flag("--show-life", o.show_life,
                "irc, trc: also life_0000.png, ...: records that last long green, short ones red; "
                "ic, tic: records that have been good for 16 frames green, new ones red");
  add_integer(verb, "--check", o.check, 0, 1 << 20,
              "irc, trc: so many records a frame are sampled anew, untimed, for the columns "
              "accuracy, reprojection_error and still_error");
}

}  // namespace haarlight
