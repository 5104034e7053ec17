// Frames under a budget in milliseconds, what the system did meanwhile, and the same work again.

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <string>

#include "bench/study.h"
#include "prt/frame_relighter.h"
#include "prt/motion.h"
#include "prt/transport.h"
#include "wavelet/environment.h"

namespace haarlight::bench {
namespace {

/// What the system kept from this process's threads until now.
struct Held {
  double waited_ms = 0;  ///< threads that could have run waited for a core, together
  long switches = 0;     ///< threads were taken off their core, times
  double stolen_ms = 0;  ///< the host ran something else on a core (in hundredths of a second)
};

Held held_so_far() {
  Held held;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream in(task.path() / "schedstat");
    double ran = 0, waited = 0;
    if (in >> ran >> waited) held.waited_ms += 1e-6 * waited;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  held.switches = usage.ru_nivcsw;
  std::ifstream in("/proc/stat");
  std::string cpu;
  std::array<double, 8> ticks{};
  in >> cpu;
  for (double& t : ticks) in >> t;
  held.stolen_ms = 10 * ticks[7];
  return held;
}

struct Frame {
  FrameMetrics metrics;
  Held held;
  std::array<double, kAgain> again_ms{};
};

}  // namespace

void study_budget(const StudyOptions& options, const std::filesystem::path& file,
                  double milliseconds) {
  const Transport transport = Transport::open(file);
  const Environment from = load_environment(options.env);
  Motion motion(options.motion, transport.layout(), from, &from);
  std::vector<Frame> frames(static_cast<std::size_t>(options.frames));
  // The first run is by the clock; the others do what it did.
  for (std::size_t run = 0; run <= kAgain; ++run) {
    LightingOptions lighting;
    FrameRelighter relighter(transport, lighting, WaveletWeight::area);
    if (run == 0) relighter.set_budget({BudgetKind::milliseconds, milliseconds});
    for (int i = 0; i < options.frames; ++i) {
      Frame& frame = frames[static_cast<std::size_t>(i)];
      const auto target = motion.coefficients(i);
      const FrameStart start = i == 0 ? FrameStart::exact : FrameStart::advance;
      if (run > 0) {
        if (frame.metrics.course.timed) relighter.repeat(frame.metrics.course);
        lighting.wavelets = std::max(frame.metrics.wavelets, 1);
        relighter.set_options(lighting, WaveletWeight::area);
        frame.again_ms[run - 1] = relighter.relight(target, start, i).total_ms;
        continue;
      }
      const Held before = held_so_far();
      frame.metrics = relighter.relight(target, start, i);
      const Held after = held_so_far();
      frame.held = {after.waited_ms - before.waited_ms, after.switches - before.switches,
                    after.stolen_ms - before.stolen_ms};
    }
  }
  std::string text =
      "frame,total_ms,update_ms,apply_ms,finish_ms,wavelets,first,resets,put_off,lighting_error,"
      "bytes,waited_ms,switches,stolen_ms,again_least_ms,again_median_ms\n";
  for (Frame& frame : frames) {
    const FrameMetrics& m = frame.metrics;
    std::sort(frame.again_ms.begin(), frame.again_ms.end());
    text += fmt::format(
        "{},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{},{:.6g},{},{:.4f},{},{:g},{:.4f},{:.4f}\n",
        m.frame, m.total_ms, m.update_ms, m.apply_ms, m.finish_ms, m.wavelets, m.course.first,
        m.resets, m.course.put_off.count(), m.lighting_error, m.bytes, frame.held.waited_ms,
        frame.held.switches, frame.held.stolen_ms, frame.again_ms.front(),
        frame.again_ms[kAgain / 2]);
  }
  write_text(options.output, text);
}

}  // namespace haarlight::bench
