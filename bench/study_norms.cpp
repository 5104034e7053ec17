// How sharp a bound of a picture's error can be made from norms of columns.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "bench/study.h"
#include "prt/frame_relighter.h"
#include "prt/motion.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"
#include "prt/transport.h"
#include "wavelet/environment.h"

namespace haarlight::bench {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
// Rows that follow each other and share a norm; 0: all.
constexpr std::array<std::size_t, 6> kGroupRows{1, 16, 64, 256, 2048, 0};

/// A frame and what it leaves out.
struct Left {
  std::string name;
  std::vector<Rgb> light;
  double error = 0, norm = 0;                                // relative; of the exact picture
  std::array<std::vector<double>, kGroupRows.size()> bound;  // [group][channel]
};

/// body(row, channel, entry) for each stored entry of a column, colours applied.
template <typename Body>
void for_entries(const Transport& transport, int column, const Body& body) {
  for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
    for_stored_blocks(
        transport.column(chunk, column), transport.rgb_blocks(chunk),
        [&](std::size_t block, bool rgb, const std::uint16_t* scale, const std::int8_t* values) {
          const std::size_t first =
              (static_cast<std::size_t>(chunk) * kChunkBlocks + block) * kRows;
          for (std::size_t r = 0; r < kRows; ++r) {
            if (transport.row_output()[first + r] == kNoOutput) continue;
            const Rgb color = transport.row_color()[first + r];
            const float of[3] = {color.r, color.g, color.b};
            for (std::size_t ch = 0; ch < 3; ++ch) {
              const std::size_t k = rgb ? ch : 0;
              body(first + r, ch,
                   static_cast<double>(scale_from_bits(scale[k]) * of[ch]) * values[k * kRows + r]);
            }
          }
        });
  }
}

std::vector<Left> frames_of(const Transport& transport, const StudyOptions& options) {
  const Environment env = load_environment(options.env);
  std::vector<Left> out;
  for (const LightingMethod method : {LightingMethod::nwa, LightingMethod::pbi}) {
    for (const int wavelets : {30, 100}) {
      Motion motion(options.motion, transport.layout(), env, nullptr);
      LightingOptions lighting;
      lighting.method = method;
      lighting.wavelets = wavelets;
      FrameRelighter relighter(transport, lighting, WaveletWeight::area);
      relighter.compare_with_reference(true);
      for (int frame = 0; frame < options.frames; ++frame) {
        const auto target = motion.coefficients(frame);
        const FrameMetrics& m =
            relighter.relight(target, frame == 0 ? FrameStart::exact : FrameStart::advance, frame);
        if (frame % 35 != 34) continue;
        Left& left = out.emplace_back();
        left.name = fmt::format("{}-{},{}", lighting_method_name(method), wavelets, frame);
        left.error = m.image_rel_rmse.value_or(0);
        const std::span<const Rgb> shown = relighter.tracker().shown();
        for (std::size_t j = 0; j < shown.size(); ++j) left.light.push_back(target[j] - shown[j]);
        for (const Rgb& p : relighter.reference()->pixels) {
          const RgbD d(p);
          left.norm += d.r * d.r + d.g * d.g + d.b * d.b;
        }
        left.norm = std::sqrt(left.norm);
      }
    }
  }
  return out;
}

// The largest singular value of some columns, each over its norm, in green: from below, by power
// iteration.
double spectral_norm(const Transport& transport, IndexRange band, const std::vector<double>& norm) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<double> x(static_cast<std::size_t>(band.size()));
  std::vector<double> rows(static_cast<std::size_t>(transport.rows()));
  for (double& v : x) v = normal(random);
  double largest = 0;
  for (int step = 0; step < 16; ++step) {
    double length = 0;
    for (const double v : x) length += v * v;
    std::fill(rows.begin(), rows.end(), 0.0);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const int j = band.begin + static_cast<int>(i);
      const double n = norm[static_cast<std::size_t>(j)];
      if (n == 0) continue;
      for_entries(transport, j, [&](std::size_t row, std::size_t ch, double entry) {
        if (ch == 1) rows[row] += x[i] / n / std::sqrt(length) * entry;
      });
    }
    largest = 0;
    for (const double v : rows) largest += v * v;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const int j = band.begin + static_cast<int>(i);
      const double n = norm[static_cast<std::size_t>(j)];
      x[i] = 0;
      if (n == 0) continue;
      for_entries(transport, j, [&](std::size_t row, std::size_t ch, double entry) {
        if (ch == 1) x[i] += rows[row] * entry / n;
      });
    }
  }
  return std::sqrt(largest);
}

}  // namespace

void study_norms(const StudyOptions& options, const std::filesystem::path& file) {
  const Transport transport = Transport::open(file);
  const HaarLayout& layout = transport.layout();
  const auto rows = static_cast<std::size_t>(transport.rows());
  std::vector<Left> frames = frames_of(transport, options);
  const auto group = [&](std::size_t kind) { return kGroupRows[kind] ? kGroupRows[kind] : rows; };
  for (Left& left : frames) {
    for (std::size_t kind = 0; kind < kGroupRows.size(); ++kind) {
      left.bound[kind].assign(3 * ((rows + group(kind) - 1) / group(kind)), 0.0);
    }
  }
  std::vector<double> green(static_cast<std::size_t>(layout.size())), square(3 * rows), norm;
  for (int j = 0; j < layout.size(); ++j) {
    const auto column = static_cast<std::size_t>(j);
    std::fill(square.begin(), square.end(), 0.0);
    for_entries(transport, j, [&](std::size_t row, std::size_t ch, double entry) {
      square[3 * row + ch] = entry * entry;
      if (ch == 1) green[column] += entry * entry;
    });
    green[column] = std::sqrt(green[column]);
    for (std::size_t kind = 0; kind < kGroupRows.size(); ++kind) {
      norm.assign(frames.front().bound[kind].size(), 0.0);
      for (std::size_t i = 0; i < square.size(); ++i)
        norm[i / 3 / group(kind) * 3 + i % 3] += square[i];
      for (double& n : norm) n = std::sqrt(n);
      for (Left& left : frames) {
        const Rgb d = left.light[column];
        const double size[3] = {std::abs(d.r), std::abs(d.g), std::abs(d.b)};
        for (std::size_t i = 0; i < norm.size(); ++i) left.bound[kind][i] += size[i % 3] * norm[i];
      }
    }
  }
  std::vector<double> largest;
  std::string bands = "band,columns,largest_singular_value\n";
  for (int b = 0; b < layout.band_count(); ++b) {
    largest.push_back(spectral_norm(transport, layout.band(b), green));
    bands += fmt::format("{},{},{:.6g}\n", b, layout.band(b).size(), largest.back());
  }
  write_text(options.output.string() + ".bands.csv", bands);
  std::string text =
      "method,frame,error,rows_1,rows_16,rows_64,rows_256,rows_2048,all,"
      "green_all,green_band_spectra\n";
  for (const Left& left : frames) {
    text += fmt::format("{},{:.6g}", left.name, left.error);
    for (const std::vector<double>& bound : left.bound) {
      double sum = 0;
      for (const double b : bound) sum += b * b;
      text += fmt::format(",{:.6g}", std::sqrt(sum) / left.norm);
    }
    // In green alone: the sum of norms, and, of each band, the smaller of that and the largest
    // singular value times the root of the sum of squares.
    double plain = 0, spectral = 0;
    for (int b = 0; b < layout.band_count(); ++b) {
      double sum = 0, squares = 0;
      for (int j = layout.band(b).begin; j < layout.band(b).end; ++j) {
        const double x = static_cast<double>(left.light[static_cast<std::size_t>(j)].g) *
                         green[static_cast<std::size_t>(j)];
        sum += std::abs(x);
        squares += x * x;
      }
      plain += sum;
      spectral += std::min(sum, largest[static_cast<std::size_t>(b)] * std::sqrt(squares));
    }
    text += fmt::format(",{:.6g},{:.6g}\n", plain / left.norm, spectral / left.norm);
  }
  write_text(options.output, text);
}

}  // namespace haarlight::bench
