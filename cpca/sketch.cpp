// Points of tens of thousands of dimensions, in a few hundred.

#include "cpca/sketch.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/hash_bits.h"
#include "core/parallel.h"
#include "core/simd.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

// to[row] += factor[row] * direction, for the rows of a block; null: no row.
HAARLIGHT_MULTIVERSION void add_block(const float* direction, const float* factor, float* const* to,
                                      std::size_t dims) {
  for (std::size_t r = 0; r < kBlock; ++r) {
    if (!to[r] || factor[r] == 0) continue;
    float* sum = to[r];
    const float f = factor[r];
    for (std::size_t d = 0; d < dims; ++d) sum[d] += f * direction[d];
  }
}

// The signs of one coordinate (term, channel, coefficient) in all directions.
void directions_of(std::uint64_t coordinate, std::uint64_t seed, std::vector<float>& out) {
  const float unit = 1 / std::sqrt(static_cast<float>(out.size()));
  for (std::size_t word = 0; word < out.size() / 64; ++word) {
    std::uint64_t bits = mix_bits(seed, mix_bits(coordinate, word));
    for (std::size_t d = 0; d < 64; ++d, bits >>= 1) out[64 * word + d] = bits & 1 ? unit : -unit;
  }
}

class ChunkSketch {
 public:
  ChunkSketch(const VertexRows& rows, std::uint64_t seed, Sketch& out)
      : rows_(rows), seed_(seed), out_(out), dims_(static_cast<std::size_t>(out.dims)) {}

  void add(int chunk);

 private:
  const VertexRows& rows_;
  std::uint64_t seed_;
  Sketch& out_;
  std::size_t dims_;
};

void ChunkSketch::add(int chunk) {
  const Transport& transport = rows_.transport();
  const auto terms = static_cast<std::size_t>(rows_.terms());
  const std::size_t first = static_cast<std::size_t>(chunk) * kChunkRows;
  const auto output = transport.row_output().subspan(first, kChunkRows);

  // Rows of a block may be of any terms in principle; what a block needs is found once.
  std::vector<float*> to(kChunkRows, nullptr);
  std::vector<float> weight(kChunkRows, 0.0f);
  std::vector<std::uint32_t> term_of(kChunkBlocks, 0);
  for (std::size_t r = 0; r < to.size(); ++r) {
    if (output[r] == kNoOutput) continue;
    to[r] = out_.point(output[r] / terms);
    weight[r] = rows_.weight(first + r);
    term_of[r / kBlock] = output[r] % static_cast<std::uint32_t>(terms);
  }
  // Grey rows go where white ones of three channels would, so that both kinds can be compared.
  const float share = rows_.any_rgb() ? 1.0f : std::sqrt(3.0f);
  const std::size_t channels = rows_.any_rgb() ? 3 : 1;
  std::vector<std::vector<float>> direction(terms * channels, std::vector<float>(dims_));
  std::vector<std::vector<float>> white(terms, std::vector<float>(dims_));
  std::array<float, kBlock> factor{};
  const int size = transport.layout().size();
  for (int j = 0; j < size; ++j) {
    const ColumnBlocks column = transport.column(chunk, j);
    if (!column.present) continue;
    for (std::size_t k = 0; k < terms; ++k) {
      for (std::size_t c = 0; c < channels; ++c) {
        const std::uint64_t coordinate =
            (k * channels + c) * static_cast<std::uint64_t>(size) + static_cast<std::uint64_t>(j);
        directions_of(coordinate, seed_, direction[k * channels + c]);
      }
      white[k] = direction[k * channels];
      for (std::size_t c = 1; c < channels; ++c) {
        for (std::size_t d = 0; d < dims_; ++d) white[k][d] += direction[k * channels + c][d];
      }
    }
    for_stored_blocks(column, transport.rgb_blocks(chunk),
                      [&](std::size_t block, bool is_rgb, const std::uint16_t* scales,
                          const std::int8_t* values) {
                        for (std::size_t c = 0; c < (is_rgb ? 3u : 1u); ++c) {
                          const float scale = scale_from_bits(scales[c]);
                          for (std::size_t r = 0; r < kBlock; ++r) {
                            factor[r] = scale * static_cast<float>(values[c * kBlock + r]);
                            if (!is_rgb) factor[r] *= share * weight[block * kBlock + r];
                          }
                          const std::size_t k = term_of[block];
                          const std::vector<float>& along =
                              is_rgb ? direction[k * channels + c] : white[k];
                          add_block(along.data(), factor.data(), to.data() + block * kBlock, dims_);
                        }
                      });
  }
}

}  // namespace

Sketch sketch_rows(const VertexRows& rows, int dims, std::uint64_t seed, const Progress& progress) {
  Sketch out;
  out.dims = dims;
  out.value.assign(rows.vertices() * static_cast<std::size_t>(dims), 0.0f);
  ChunkSketch sketch(rows, seed, out);
  // A vertex's terms may lie in chunks that follow each other, as many as 16 vertices fill: chunks
  // are taken that far apart, so that no sum has two owners and each has one order.
  const int chunks = rows.transport().chunk_count();
  int done = 0;
  const int run = kBlockRows * rows.terms();
  const int stride = 1 + (run + kChunkRows - 1) / kChunkRows;
  for (int phase = 0; phase < std::min(stride, chunks); ++phase) {
    parallel_for((chunks - phase + stride - 1) / stride, [&](int i) {
      sketch.add(stride * i + phase);
      bool go_on = true;
#pragma omp critical(haarlight_sketch_progress)
      {
        ++done;
        if (progress) go_on = progress(static_cast<double>(done) / chunks);
      }
      if (!go_on) throw Error(ErrorKind::cancelled, "compression stopped on request");
    });
  }
  return out;
}

}  // namespace haarlight
