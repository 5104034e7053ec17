// Runs frames one after the other, as fast as they come.

#include "viewer/headless.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "core/error.h"
#include "core/image_io.h"
#include "core/image_metrics.h"
#include "prt/metrics_csv.h"
#include "prt/tonemap.h"
#include "viewer/session.h"

namespace haarlight::viewer {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::string run_headless(const RunOptions& options) {
  if (options.transport.empty() || options.env.empty()) {
    throw Error(ErrorKind::missing,
                "no window and nothing to show, expected a transport file and --env");
  }
  Session session;
  session.act(OpenTransport{options.transport});
  session.act(OpenEnvironment{options.env});
  if (!options.env_to.empty()) session.act(OpenEnvironment{options.env_to});
  if (!options.record.empty()) session.act(StartRecording{});
  std::optional<MetricsCsvWriter> table;
  if (!options.metrics.empty()) table.emplace(options.metrics);

  ViewSettings settings = options.settings;
  settings.playing = true;
  settings.compare |= options.compare != CompareView::none;
  ViewFrame frame;
  std::vector<double> light, relight;
  for (int i = 0; i < options.frames; ++i) {
    // A frame that would repeat the last one is asked for all the same, so that every number of
    // --frames gives as many rows.
    if (session.resting(settings)) session.act(Step{});
    if (!session.advance(settings, 1, frame)) {
      session.act(Step{});
      session.advance(settings, 1, frame);
    }
    if (table) table->add(frame.metrics);
    light.push_back(frame.light_ms);
    relight.push_back(frame.metrics.total_ms);
  }

  if (table) table->commit();
  if (!options.record.empty()) session.act(StopRecording{options.record});
  if (!options.exr.empty()) session.act(SavePicture{options.exr});
  if (!options.screenshot.empty()) {
    const double exposure = options.exposure_ev.value_or(frame.exact_exposure_ev);
    const Image picture = session.picture_with_background();
    check_finite(picture, options.screenshot.string());
    save_image(options.screenshot,
               options.false_colour
                   ? false_colour(picture, exposure)
                   : tonemap(picture, {.curve = options.curve, .exposure_ev = exposure}));
  }
  if (!options.timings) return {};
  return fmt::format("frames {}\nlight_ms {:.3f}\nrelight_ms {:.3f}\n", options.frames,
                     median(light), median(relight));
}

}  // namespace haarlight::viewer
