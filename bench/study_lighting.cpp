// What the light does, and what methods choose of it, without any transport.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "bench/study.h"
#include "core/atomic_file.h"
#include "wavelet/environment.h"

namespace haarlight::bench {
namespace {

struct Light {
  Light(const StudyOptions& options, int face)
      : layout(face),
        from(load_environment(options.env)),
        to(options.env_to.empty() ? from : load_environment(options.env_to)),
        motion(options.motion, layout, from, &to) {}
  HaarLayout layout;
  Environment from, to;
  Motion motion;
};

// Adds 1 to every texel under a wavelet. Indices within a level are (face, orientation, y, x).
void cover(const HaarLayout& layout, int index, std::vector<int>& count) {
  const int n = layout.face_size();
  int side = n, face = index, x = 0, y = 0;  // of a scaling function: the face
  if (index >= 6) {
    int level = 1;  // wavelets a row of a face
    while (index >= 6 * 4 * level * level) level *= 2;
    const int within = index - 6 * level * level;
    face = within / (3 * level * level);
    x = within % level;
    y = within / level % level;
    side = n / level;
  }
  for (int v = y * side; v < (y + 1) * side; ++v) {
    for (int u = x * side; u < (x + 1) * side; ++u) {
      ++count[static_cast<std::size_t>((face * n + v) * n + u)];
    }
  }
}

}  // namespace

void write_text(const std::filesystem::path& path, const std::string& text) {
  AtomicFile file(path);
  file.write(text.data(), text.size());
  file.commit();
}

void study_chosen(const StudyOptions& options, int face, const LightingOptions& lighting,
                  const std::vector<int>& maps) {
  Light light(options, face);
  LightingTracker tracker(light.layout, lighting);
  std::string rows = "frame,band,area,chosen,reset\n", map = "frame,face,y,x,count\n";
  for (int frame = 0; frame < options.frames; ++frame) {
    const auto target = light.motion.coefficients(frame);
    if (frame == 0) {
      tracker.start_exact(target);
      continue;
    }
    const LightingUpdate& update = tracker.advance(target);
    std::vector<int> chosen(static_cast<std::size_t>(light.layout.band_count()));
    for (const WaveletDelta& d : update.deltas) {
      ++chosen[static_cast<std::size_t>(light.layout.band_of(d.index))];
    }
    for (int b = 0; b < light.layout.band_count(); ++b) {
      rows += fmt::format("{},{},{},{},{}\n", frame, b, light.layout.area(b),
                          chosen[static_cast<std::size_t>(b)],
                          update.reset[static_cast<std::size_t>(b)] ? 1 : 0);
    }
    if (std::find(maps.begin(), maps.end(), frame) == maps.end()) continue;
    std::vector<int> count(static_cast<std::size_t>(light.layout.size()));
    for (const WaveletDelta& d : update.deltas) cover(light.layout, d.index, count);
    for (int i = 0; i < light.layout.size(); ++i) {
      if (const int c = count[static_cast<std::size_t>(i)]) {
        map +=
            fmt::format("{},{},{},{},{}\n", frame, i / face / face, i / face % face, i % face, c);
      }
    }
  }
  write_text(options.output, rows);
  write_text(options.output.string() + ".map.csv", map);
}

void study_energy(const StudyOptions& options, int face) {
  constexpr int kFrames = 128, kTemporal = 8;
  Light light(options, face);
  const auto size = static_cast<std::size_t>(light.layout.size());
  std::vector<RgbD> series(kFrames * size);  // [frame][coefficient]
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto target = light.motion.coefficients(frame);
    for (std::size_t j = 0; j < size; ++j) {
      series[static_cast<std::size_t>(frame) * size + j] = RgbD(target[j]);
    }
  }
  std::vector<double> energy(static_cast<std::size_t>(light.layout.band_count() * kTemporal));
  const double half = std::sqrt(0.5);
  std::vector<RgbD> line(kFrames), next(kFrames);
  for (std::size_t j = 0; j < size; ++j) {
    const auto band = static_cast<std::size_t>(light.layout.band_of(static_cast<int>(j)));
    for (std::size_t f = 0; f < kFrames; ++f) line[f] = series[f * size + j];
    const auto add = [&](int temporal, const RgbD& c) {
      energy[band * kTemporal + static_cast<std::size_t>(temporal)] +=
          c.r * c.r + c.g * c.g + c.b * c.b;
    };
    // The first step leaves differences of single frames: wavelets of two frames, band 7.
    int temporal = kTemporal - 1;
    for (std::size_t count = kFrames; count > 1; count /= 2, --temporal) {
      for (std::size_t f = 0; f < count / 2; ++f) {
        add(temporal, (line[2 * f] - line[2 * f + 1]) * half);
        next[f] = (line[2 * f] + line[2 * f + 1]) * half;
      }
      std::swap(line, next);
    }
    add(0, line[0]);
  }
  std::string rows = "band,area,temporal,frames,energy\n";
  for (int b = 0; b < light.layout.band_count(); ++b) {
    for (int t = 0; t < kTemporal; ++t) {
      rows += fmt::format("{},{},{},{},{:.9g}\n", b, light.layout.area(b), t,
                          t == 0 ? kFrames : kFrames >> (t - 1),
                          energy[static_cast<std::size_t>(b * kTemporal + t)]);
    }
  }
  write_text(options.output, rows);
}

}  // namespace haarlight::bench
