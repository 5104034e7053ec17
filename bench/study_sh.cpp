// A sequence by spherical harmonics, measured as relight measures its own.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bench/study.h"
#include "core/image_io.h"
#include "core/image_metrics.h"
#include "prt/metrics_csv.h"
#include "prt/picture_relighter.h"

namespace haarlight::bench {
namespace {

double change_against(const Image& picture, const Image& before, const Image& exact,
                      const Image& exact_before) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    const RgbD r(exact.pixels[i]);
    const RgbD d =
        (RgbD(picture.pixels[i]) - RgbD(before.pixels[i])) - (r - RgbD(exact_before.pixels[i]));
    difference += d.r * d.r + d.g * d.g + d.b * d.b;
    norm += r.r * r.r + r.g * r.g + r.b * r.b;
  }
  return difference > 0 ? std::sqrt(difference / norm) : 0;
}

}  // namespace

void study_sh(const StudyOptions& options, const std::filesystem::path& file, const ShOptions& sh,
              const std::filesystem::path& folder, const std::vector<int>& save) {
  const Transport transport = Transport::open(file);
  const Environment from = load_environment(options.env);
  const Environment to = options.env_to.empty() ? from : load_environment(options.env_to);
  Motion motion(options.motion, transport.layout(), from, &to);
  ShRelighter relighter(transport, sh);
  PictureRelighter exact(transport);
  exact.expect_resets(false);
  LightingOptions all;
  all.method = LightingMethod::reference;
  LightingTracker exact_tracker(transport.layout(), all);

  const std::string name = fmt::format("sh{}{}", sh.order, sh.incremental ? "i" : "");
  AtomicFile table(options.output);
  const auto line = [&](const std::string& text) {
    const std::string ended = text + "\n";
    table.write(ended.data(), ended.size());
  };
  line(metrics_csv_header());
  Image before, exact_before;
  for (int frame = 0; frame < options.frames; ++frame) {
    const auto target = motion.coefficients(frame);
    const auto begin = std::chrono::steady_clock::now();
    const ShRelighter::Frame f = relighter.relight(target, frame == 0);
    const std::chrono::duration<double, std::milli> total =
        std::chrono::steady_clock::now() - begin;
    exact.apply(exact_tracker.advance(target));
    const ImageDifference difference = compare_images(relighter.picture(), exact.picture());
    FrameMetrics m;
    m.frame = frame;
    m.wavelets = sh.incremental ? sh.terms : sh_count(sh.order);
    m.weight = WaveletWeight::transport;
    m.updates = f.updates;
    m.resets = f.resets;
    m.lighting_error = std::nan("");  // of wavelets: has no meaning here
    m.image_rel_rmse = difference.relative_rmse;
    m.image_max_abs = difference.max_abs;
    m.update_ms = f.update_ms;
    m.apply_ms = f.stats.apply_ms;
    m.finish_ms = f.stats.finish_ms;
    m.total_ms = total.count();
    m.bytes = f.stats.apply.transport_bytes + f.stats.apply.sum_bytes;
    m.flicker =
        frame == 0 ? 0 : change_against(relighter.picture(), before, exact.picture(), exact_before);
    std::string row = metrics_csv_row(m);
    const std::size_t comma = row.find(',') + 1;
    row.replace(comma, row.find(',', comma) - comma, name);
    line(row);
    before = relighter.picture();
    exact_before = exact.picture();
    if (std::find(save.begin(), save.end(), frame) != save.end()) {
      std::filesystem::create_directories(folder);
      save_image(folder / fmt::format("frame_{:04}.exr", frame), relighter.picture());
    }
  }
  table.commit();
}

}  // namespace haarlight::bench
