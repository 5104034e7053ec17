// A picture's transport at fewer bits an entry: how large it would be, and what that costs.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "bench/study.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/rgb.h"
#include "prt/lighting_tracker.h"
#include "prt/motion.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"
#include "prt/transport.h"
#include "wavelet/environment.h"

namespace haarlight::bench {
namespace {

constexpr int kTerms[] = {40, 100, 200};
// Pictures: all coefficients, then the largest of each number; as stored, then at fewer bits.
constexpr std::size_t kSets = 1 + std::size(kTerms), kPictures = 2 * kSets;

/// Of a chunk.
struct Sums {
  std::uint64_t blocks = 0, entries = 0;  // values stored, in runs of 16; not zero at fewer bits
  std::vector<double> pictures;           // [picture][row][channel]
};

/// Whether a coefficient is in each set.
struct Light {
  std::vector<Rgb> coefficient;
  std::vector<std::uint8_t> sets;
};

Light light_of(const HaarLayout& layout, std::span<const Rgb> target) {
  Light light;
  light.coefficient.assign(target.begin(), target.end());
  light.sets.assign(target.size(), 1);
  for (std::size_t k = 0; k < std::size(kTerms); ++k) {
    LightingOptions options;
    options.method = LightingMethod::nwa;
    options.wavelets = kTerms[k];
    LightingTracker tracker(layout, options);
    for (const WaveletDelta& d : tracker.advance(target).deltas) {
      light.sets[static_cast<std::size_t>(d.index)] |= static_cast<std::uint8_t>(2 << k);
    }
  }
  return light;
}

Sums stream(const Transport& transport, int chunk, const Light& light, int most) {
  constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
  constexpr std::size_t kPicture = 3 * kChunkBlocks * kRows;
  Sums out;
  out.pictures.assign(kPictures * kPicture, 0.0);
  const double coarser = 127.0 / most;  // of a scale, which is the largest entry's over 127
  for (int j = 0; j < transport.layout().size(); ++j) {
    const Rgb l = light.coefficient[static_cast<std::size_t>(j)];
    const double of[3] = {static_cast<double>(l.r), static_cast<double>(l.g),
                          static_cast<double>(l.b)};
    for_stored_blocks(
        transport.column(chunk, j), transport.rgb_blocks(chunk),
        [&](std::size_t block, bool rgb, const std::uint16_t* scale, const std::int8_t* values) {
          out.blocks += rgb ? 3 : 1;
          for (std::size_t ch = 0; ch < 3; ++ch) {
            const double s = static_cast<double>(scale_from_bits(scale[rgb ? ch : 0])) * of[ch];
            const std::int8_t* q = values + (rgb ? ch * kRows : 0);
            double fine[kRows], coarse[kRows];
            for (std::size_t r = 0; r < kRows; ++r) {
              const double rounded = std::nearbyint(q[r] / coarser);
              if (rgb || ch == 0) out.entries += rounded != 0;
              fine[r] = s * q[r];
              coarse[r] = s * coarser * rounded;
            }
            for (std::size_t set = 0; set < kSets; ++set) {
              if (!(light.sets[static_cast<std::size_t>(j)] >> set & 1)) continue;
              double* stored = out.pictures.data() + set * kPicture + 3 * block * kRows + ch;
              double* fewer = stored + kSets * kPicture;
              for (std::size_t r = 0; r < kRows; ++r) {
                stored[3 * r] += fine[r];
                fewer[3 * r] += coarse[r];
              }
            }
          }
        });
  }
  return out;
}

}  // namespace

void study_bits(const StudyOptions& options, const std::filesystem::path& file, int bits) {
  if (bits < 2 || bits > 8) {
    throw Error(ErrorKind::invalid_argument, fmt::format("{} bits, expected 2 to 8", bits));
  }
  const Transport transport = Transport::open(file);
  const Environment from = load_environment(options.env);
  Motion motion(options.motion, transport.layout(), from, &from);
  std::string text =
      "frame,bits,file_bytes,bytes,entries,error_all,error_40,error_100,error_200,"
      "stored_40,stored_100,stored_200\n";
  for (int frame = 0; frame < options.frames; ++frame) {
    const Light light = light_of(transport.layout(), motion.coefficients(frame));
    const auto chunks = static_cast<std::size_t>(transport.chunk_count());
    std::vector<double> off(chunks * kPictures), norm(chunks);
    std::vector<std::uint64_t> blocks(chunks), entries(chunks);
    parallel_for(transport.chunk_count(), [&](int chunk) {
      const auto c = static_cast<std::size_t>(chunk);
      const Sums sums = stream(transport, chunk, light, (1 << (bits - 1)) - 1);
      blocks[c] = sums.blocks;
      entries[c] = sums.entries;
      const std::size_t size = sums.pictures.size() / kPictures;
      for (std::size_t i = 0; i < size; ++i) {
        const std::size_t row = c * size / 3 + i / 3;
        if (transport.row_output()[row] == kNoOutput) continue;
        const Rgb color = transport.row_color()[row];
        const double of = static_cast<double>(i % 3 == 0   ? color.r
                                              : i % 3 == 1 ? color.g
                                                           : color.b);
        const double exact = of * sums.pictures[i];
        norm[c] += exact * exact;
        for (std::size_t p = 0; p < kPictures; ++p) {
          const double d = of * sums.pictures[p * size + i] - exact;
          off[c * kPictures + p] += d * d;
        }
      }
    });
    double all = 0, error[kPictures] = {};
    std::uint64_t stored = 0, not_zero = 0;
    for (std::size_t c = 0; c < chunks; ++c) {
      all += norm[c];
      stored += blocks[c];
      not_zero += entries[c];
      for (std::size_t p = 0; p < kPictures; ++p) error[p] += off[c * kPictures + p];
    }
    for (double& e : error) e = std::sqrt(e / all);
    // Every run of 16 values gives back 2 bytes a bit less.
    const std::uint64_t file_bytes = std::filesystem::file_size(file);
    text += fmt::format("{},{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", frame,
                        bits, file_bytes,
                        file_bytes - 2 * static_cast<std::uint64_t>(8 - bits) * stored, not_zero,
                        error[kSets], error[kSets + 1], error[kSets + 2], error[kSets + 3],
                        error[1], error[2], error[3]);
  }
  write_text(options.output, text);
}

}  // namespace haarlight::bench
