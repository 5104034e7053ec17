// A few rows of a scene at low resolution, as pictures under the built-in lightings.

#include "precompute/probe.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "precompute/random.h"
#include "prt/prior_lighting.h"

namespace haarlight {
namespace {

constexpr int kFace = 16;
constexpr std::size_t kProbeRows = 256;

double square(const RgbD& c) { return c.r * c.r + c.g * c.g + c.b * c.b; }

}  // namespace

double Pictures::energy_error(const Pictures& a, const Pictures& b) const {
  const auto stride = static_cast<std::size_t>(lightings + 1);
  double sum = 0;
  int lit = 0;
  for (std::size_t l = 0; l < static_cast<std::size_t>(lightings); ++l) {
    double difference = 0, energy = 0;
    for (std::size_t at = l; at < value.size(); at += stride) {
      difference += square(a.value[at] - b.value[at]);
      energy += square(value[at]);
    }
    if (!(energy > 0)) continue;
    sum += difference / energy;
    ++lit;
  }
  return lit > 0 ? std::sqrt(sum / lit) : 0;
}

double Pictures::error(const Pictures& other) const { return energy_error(*this, other); }

double Pictures::even_light() const {
  const auto stride = static_cast<std::size_t>(lightings + 1);
  double sum = 0;
  for (std::size_t at = stride - 1; at < value.size(); at += stride) sum += luminance(value[at]);
  return sum;
}

Probe::Probe(const SourceMaker& source, std::span<const std::uint32_t> order,
             const TraceOptions& base)
    : source_(source), trace_(base) {
  trace_.face_size = kFace;
  trace_.indirect_face = kFace;
  trace_.pixel_samples = 1;
  trace_.noise = 1e-9;
  trace_.paths = kPathBatch;
  // Evenly along the order, which runs along the picture or the mesh, each a little off.
  std::vector<std::uint32_t> used;
  for (const std::uint32_t output : order) {
    if (output != kNoOutput) used.push_back(output);
  }
  const std::size_t count = std::min(kProbeRows, used.size());
  for (std::size_t i = 0; i < count; ++i) {
    const double at = (static_cast<double>(i) + unit_number(mix_bits(7, i))) *
                      static_cast<double>(used.size()) / static_cast<double>(count);
    outputs_.push_back(used[std::min(used.size() - 1, static_cast<std::size_t>(at))]);
  }
  while (outputs_.size() % kTileRows != 0) outputs_.push_back(kNoOutput);
}

Pictures Probe::pictures(const Effects& effects) {
  TraceOptions trace = trace_;
  trace.effects = effects;
  const auto tiles = source_(trace);
  const HaarLayout& layout = tiles->layout();
  const auto size = static_cast<std::size_t>(layout.size());
  const auto& lightings = prior_lightings(layout);
  Pictures out;
  out.lightings = static_cast<int>(lightings.size());
  const std::size_t stride = lightings.size() + 1;
  out.value.assign(outputs_.size() * stride, RgbD{});
  const int count = static_cast<int>(outputs_.size() / kTileRows);
  std::vector<std::int64_t> rays(static_cast<std::size_t>(count), 0);
  parallel_for(count, [&](int tile) {
    const auto worker = tiles->make_worker();
    TileRows rows;
    const std::size_t first = static_cast<std::size_t>(tile) * kTileRows;
    worker->trace(std::span(outputs_).subspan(first, kTileRows), rows);
    rays[static_cast<std::size_t>(tile)] = worker->counts.rays();
    for (std::size_t row = 0; row < kTileRows; ++row) {
      const bool rgb = (rows.rgb_blocks >> (row / kBlockRows) & 1u) != 0;
      for (std::size_t l = 0; l < stride; ++l) {
        double sum[3] = {};
        for (std::size_t c = 0; c < (rgb ? 3u : 1u); ++c) {
          const float* values = rows.values.data() + (c * kTileRows + row) * size;
          if (l + 1 == stride) {  // an even sky of 1 has n in each scaling coefficient
            for (std::size_t j = 0; j < 6; ++j) sum[c] += layout.face_size() * double{values[j]};
          } else {
            for (std::size_t j = 0; j < size; ++j) {
              sum[c] += static_cast<double>(values[j]) * static_cast<double>(lightings[l][j]);
            }
          }
        }
        if (!rgb) sum[1] = sum[2] = sum[0];
        out.value[(first + row) * stride + l] =
            RgbD(rows.color[row]) * RgbD(sum[0], sum[1], sum[2]);
      }
    }
  });
  for (const std::int64_t r : rays) rays_ += r;
  return out;
}

}  // namespace haarlight
