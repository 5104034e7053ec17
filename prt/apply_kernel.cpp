// Block by block over a batch of columns: a block's sums stay in registers while every column that
// has the block is added. Which columns those are comes from the columns' bitmaps, transposed.

#include "prt/apply_kernel.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace haarlight {
namespace {

constexpr std::size_t kBatch = 64;  // columns whose bitmaps fit one transposed matrix
constexpr std::size_t kRowsOfBlock = kBlockRows;

// Rows and columns of a 64 x 64 bit matrix change places: bit j of m[i] and bit i of m[j].
// Warren, Hacker's Delight, section 7-3, widened to 64.
void transpose_bits(std::uint64_t* m) {
  std::uint64_t mask = 0x00000000ffffffffull;
  for (unsigned width = 32; width != 0; width >>= 1, mask ^= mask << width) {
    for (unsigned k = 0; k < 64; k = (k + width + 1) & ~width) {
      const std::uint64_t swapped = (m[k] >> width ^ m[k + width]) & mask;
      m[k] ^= swapped << width;
      m[k + width] ^= swapped;
    }
  }
}

float scale_of(std::uint16_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16);
}

// Where each column of a batch goes on reading.
struct Cursors {
  const std::uint16_t* scales[kBatch];
  const std::int8_t* values[kBatch];
};

struct PortableBlock {
  static void add_grey(std::uint64_t columns, const ColumnTask* tasks, Cursors& at,
                       double* totals) {
    for (; columns; columns &= columns - 1) {
      const auto t = static_cast<std::size_t>(std::countr_zero(columns));
      const double scale = static_cast<double>(scale_of(*at.scales[t]++));
      const std::int8_t* q = at.values[t];
      at.values[t] += kRowsOfBlock;
      for (std::size_t ch = 0; ch < 3; ++ch) {
        const double factor = scale * tasks[t].delta[ch];
        double* sum = totals + ch * kRowsOfBlock;
        for (std::size_t r = 0; r < kRowsOfBlock; ++r) sum[r] += factor * q[r];
      }
    }
  }
  static void add_rgb(std::uint64_t columns, const ColumnTask* tasks, Cursors& at, double* totals) {
    for (; columns; columns &= columns - 1) {
      const auto t = static_cast<std::size_t>(std::countr_zero(columns));
      for (std::size_t ch = 0; ch < 3; ++ch) {
        const double factor = static_cast<double>(scale_of(*at.scales[t]++)) * tasks[t].delta[ch];
        const std::int8_t* q = at.values[t];
        at.values[t] += kRowsOfBlock;
        double* sum = totals + ch * kRowsOfBlock;
        for (std::size_t r = 0; r < kRowsOfBlock; ++r) sum[r] += factor * q[r];
      }
    }
  }
};

#if defined(__x86_64__)
#define HAARLIGHT_AVX2 __attribute__((target("avx2,fma")))

// Four rows as doubles. The load is of 4 bytes exactly.
HAARLIGHT_AVX2 inline __m256d four_rows(const std::int8_t* q) {
  int bits;
  std::memcpy(&bits, q, 4);
  return _mm256_cvtepi32_pd(_mm_cvtepi8_epi32(_mm_cvtsi32_si128(bits)));
}

// Streams jump from chunk to chunk, where the hardware cannot foresee them; inside a column it can.
HAARLIGHT_AVX2 inline void prefetch_ahead(const std::int8_t* q) {
  _mm_prefetch(reinterpret_cast<const char*>(q + 256), _MM_HINT_T0);
}

struct Avx2Block {
  // 48 sums of a block are twelve registers; three factors and the rows' values fill the sixteen.
  HAARLIGHT_AVX2 static void add_grey(std::uint64_t columns, const ColumnTask* tasks, Cursors& at,
                                      double* totals) {
    __m256d r0 = _mm256_loadu_pd(totals), r1 = _mm256_loadu_pd(totals + 4);
    __m256d r2 = _mm256_loadu_pd(totals + 8), r3 = _mm256_loadu_pd(totals + 12);
    __m256d g0 = _mm256_loadu_pd(totals + 16), g1 = _mm256_loadu_pd(totals + 20);
    __m256d g2 = _mm256_loadu_pd(totals + 24), g3 = _mm256_loadu_pd(totals + 28);
    __m256d b0 = _mm256_loadu_pd(totals + 32), b1 = _mm256_loadu_pd(totals + 36);
    __m256d b2 = _mm256_loadu_pd(totals + 40), b3 = _mm256_loadu_pd(totals + 44);
    for (; columns; columns &= columns - 1) {
      const auto t = static_cast<std::size_t>(std::countr_zero(columns));
      const double scale = static_cast<double>(scale_of(*at.scales[t]++));
      const std::int8_t* q = at.values[t];
      at.values[t] += kRowsOfBlock;
      prefetch_ahead(q);
      const __m256d fr = _mm256_set1_pd(scale * tasks[t].delta[0]);
      const __m256d fg = _mm256_set1_pd(scale * tasks[t].delta[1]);
      const __m256d fb = _mm256_set1_pd(scale * tasks[t].delta[2]);
      __m256d v = four_rows(q);
      r0 = _mm256_fmadd_pd(v, fr, r0);
      g0 = _mm256_fmadd_pd(v, fg, g0);
      b0 = _mm256_fmadd_pd(v, fb, b0);
      v = four_rows(q + 4);
      r1 = _mm256_fmadd_pd(v, fr, r1);
      g1 = _mm256_fmadd_pd(v, fg, g1);
      b1 = _mm256_fmadd_pd(v, fb, b1);
      v = four_rows(q + 8);
      r2 = _mm256_fmadd_pd(v, fr, r2);
      g2 = _mm256_fmadd_pd(v, fg, g2);
      b2 = _mm256_fmadd_pd(v, fb, b2);
      v = four_rows(q + 12);
      r3 = _mm256_fmadd_pd(v, fr, r3);
      g3 = _mm256_fmadd_pd(v, fg, g3);
      b3 = _mm256_fmadd_pd(v, fb, b3);
    }
    _mm256_storeu_pd(totals, r0), _mm256_storeu_pd(totals + 4, r1);
    _mm256_storeu_pd(totals + 8, r2), _mm256_storeu_pd(totals + 12, r3);
    _mm256_storeu_pd(totals + 16, g0), _mm256_storeu_pd(totals + 20, g1);
    _mm256_storeu_pd(totals + 24, g2), _mm256_storeu_pd(totals + 28, g3);
    _mm256_storeu_pd(totals + 32, b0), _mm256_storeu_pd(totals + 36, b1);
    _mm256_storeu_pd(totals + 40, b2), _mm256_storeu_pd(totals + 44, b3);
  }

  HAARLIGHT_AVX2 static void add_rgb(std::uint64_t columns, const ColumnTask* tasks, Cursors& at,
                                     double* totals) {
    __m256d sum[12];
    for (int i = 0; i < 12; ++i) sum[i] = _mm256_loadu_pd(totals + 4 * i);
    for (; columns; columns &= columns - 1) {
      const auto t = static_cast<std::size_t>(std::countr_zero(columns));
      const std::int8_t* q = at.values[t];
      const std::uint16_t* scales = at.scales[t];
      at.values[t] += 3 * kRowsOfBlock;
      at.scales[t] += 3;
      prefetch_ahead(q);
#pragma GCC unroll 3
      for (int ch = 0; ch < 3; ++ch) {
        const __m256d factor =
            _mm256_set1_pd(static_cast<double>(scale_of(scales[ch])) * tasks[t].delta[ch]);
#pragma GCC unroll 4
        for (int k = 0; k < 4; ++k) {
          sum[4 * ch + k] =
              _mm256_fmadd_pd(four_rows(q + 16 * ch + 4 * k), factor, sum[4 * ch + k]);
        }
      }
    }
    for (int i = 0; i < 12; ++i) _mm256_storeu_pd(totals + 4 * i, sum[i]);
  }
};
#endif

template <typename Block>
void apply_batches(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                   double* totals) {
  for (std::size_t first = 0; first < tasks.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, tasks.size() - first);
    const ColumnTask* batch = tasks.data() + first;
    Cursors at;
    for (std::size_t t = 0; t < count; ++t) {
      at.scales[t] = batch[t].blocks.scales;
      at.values[t] = batch[t].blocks.values;
    }
    for (std::size_t word = 0; word < 4; ++word) {
      std::uint64_t columns_of[64] = {};
      for (std::size_t t = 0; t < count; ++t) columns_of[t] = batch[t].blocks.present[word];
      transpose_bits(columns_of);
      for (std::size_t bit = 0; bit < 64; ++bit) {
        if (columns_of[bit] == 0) continue;
        double* block = totals + (64 * word + bit) * kBlockTotals;
        if (rgb_blocks[word] >> bit & 1) {
          Block::add_rgb(columns_of[bit], batch, at, block);
        } else {
          Block::add_grey(columns_of[bit], batch, at, block);
        }
      }
    }
  }
}

using Kernel = void (*)(const std::uint64_t*, std::span<const ColumnTask>, double*);

Kernel pick_kernel() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    return apply_batches<Avx2Block>;
  }
#endif
  return apply_batches<PortableBlock>;
}

const Kernel kKernel = pick_kernel();

}  // namespace

void apply_columns(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                   double* totals) {
  kKernel(rgb_blocks, tasks, totals);
}

void apply_columns_portable(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                            double* totals) {
  apply_batches<PortableBlock>(rgb_blocks, tasks, totals);
}

const char* apply_kernel_name() {
  return kKernel == &apply_batches<PortableBlock> ? "portable" : "avx2";
}

}  // namespace haarlight
