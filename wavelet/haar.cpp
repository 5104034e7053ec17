// The Haar transform on cube faces; see haar.h for the basis and numbering.

#include "wavelet/haar.h"

#include <fmt/format.h>

#include <bit>
#include <cstddef>
#include <vector>

#include "core/denormals.h"
#include "core/error.h"
#include "core/simd.h"

namespace haarlight {
namespace {

// One level of one face: s x s scaling values in, a quarter of them and three wavelets out, each
// m x m with m = s / 2. Plain arrays, so that the compiler vectorises each version.
template <typename T>
inline __attribute__((always_inline)) void analyse(const T* in, int m, T* scaling, T* horizontal,
                                                   T* vertical, T* diagonal) {
  const T half = T(0.5);
  for (int y = 0; y < m; ++y) {
    const T* top = in + static_cast<std::ptrdiff_t>(2 * y) * (2 * m);
    const T* bottom = top + 2 * m;
    T* s = scaling + static_cast<std::ptrdiff_t>(y) * m;
    T* h = horizontal + static_cast<std::ptrdiff_t>(y) * m;
    T* v = vertical + static_cast<std::ptrdiff_t>(y) * m;
    T* d = diagonal + static_cast<std::ptrdiff_t>(y) * m;
#pragma GCC ivdep
    for (int x = 0; x < m; ++x) {
      const T sum_top = top[2 * x] + top[2 * x + 1], diff_top = top[2 * x] - top[2 * x + 1];
      const T sum_bottom = bottom[2 * x] + bottom[2 * x + 1];
      const T diff_bottom = bottom[2 * x] - bottom[2 * x + 1];
      s[x] = half * (sum_top + sum_bottom);
      h[x] = half * (diff_top + diff_bottom);
      v[x] = half * (sum_top - sum_bottom);
      d[x] = half * (diff_top - diff_bottom);
    }
  }
}

template <typename T>
inline __attribute__((always_inline)) void synthesise(const T* scaling, const T* horizontal,
                                                      const T* vertical, const T* diagonal, int m,
                                                      T* out) {
  const T half = T(0.5);
  for (int y = 0; y < m; ++y) {
    T* top = out + static_cast<std::ptrdiff_t>(2 * y) * (2 * m);
    T* bottom = top + 2 * m;
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(y) * m;
#pragma GCC ivdep
    for (int x = 0; x < m; ++x) {
      const T s = scaling[row + x], h = horizontal[row + x];
      const T v = vertical[row + x], d = diagonal[row + x];
      top[2 * x] = half * ((s + h) + (v + d));
      top[2 * x + 1] = half * ((s - h) + (v - d));
      bottom[2 * x] = half * ((s + h) - (v + d));
      bottom[2 * x + 1] = half * ((s - h) - (v - d));
    }
  }
}

HAARLIGHT_MULTIVERSION void analyse_level(const float* in, int m, float* s, float* h, float* v,
                                          float* d) {
  analyse(in, m, s, h, v, d);
}
HAARLIGHT_MULTIVERSION void analyse_level(const double* in, int m, double* s, double* h, double* v,
                                          double* d) {
  analyse(in, m, s, h, v, d);
}
HAARLIGHT_MULTIVERSION void synthesise_level(const float* s, const float* h, const float* v,
                                             const float* d, int m, float* out) {
  synthesise(s, h, v, d, m, out);
}
HAARLIGHT_MULTIVERSION void synthesise_level(const double* s, const double* h, const double* v,
                                             const double* d, int m, double* out) {
  synthesise(s, h, v, d, m, out);
}

// First coefficient of one orientation (0 h, 1 v, 2 d) of one face at the level of m x m wavelets.
std::size_t wavelet_begin(int face, int orientation, int m) {
  const auto mm = static_cast<std::size_t>(m) * static_cast<std::size_t>(m);
  return 6 * mm + (3 * static_cast<std::size_t>(face) + static_cast<std::size_t>(orientation)) * mm;
}

// Two buffers that levels alternate between, kept per thread.
template <typename T>
std::vector<T>& level_buffer() {
  thread_local std::vector<T> buffer;
  return buffer;
}

template <typename T>
void forward_faces(int n, const T* texels, T* coefficients) {
  const std::size_t face_texels = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  std::vector<T>& buffer = level_buffer<T>();
  if (buffer.size() < face_texels) buffer.resize(face_texels);
  for (int face = 0; face < 6; ++face) {
    const T* in = texels + static_cast<std::size_t>(face) * face_texels;
    std::size_t parity = 0;
    for (int m = n / 2; m >= 1; m /= 2) {
      // A level's scaling values take a quarter; the halves of the buffer alternate.
      T* scaling = buffer.data() + parity * (face_texels / 2);
      analyse_level(in, m, scaling, coefficients + wavelet_begin(face, 0, m),
                    coefficients + wavelet_begin(face, 1, m),
                    coefficients + wavelet_begin(face, 2, m));
      in = scaling;
      parity ^= 1;
    }
    coefficients[face] = in[0];
  }
}

template <typename T>
void inverse_faces(int n, const T* coefficients, T* texels) {
  const std::size_t face_texels = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  std::vector<T>& buffer = level_buffer<T>();
  if (buffer.size() < face_texels) buffer.resize(face_texels);
  for (int face = 0; face < 6; ++face) {
    T* out = texels + static_cast<std::size_t>(face) * face_texels;
    if (n == 1) {
      out[0] = coefficients[face];
      continue;
    }
    const T* scaling = coefficients + face;
    std::size_t parity = 0;
    for (int m = 1; m <= n / 2; m *= 2) {
      T* to = m == n / 2 ? out : buffer.data() + parity * (face_texels / 2);
      synthesise_level(scaling, coefficients + wavelet_begin(face, 0, m),
                       coefficients + wavelet_begin(face, 1, m),
                       coefficients + wavelet_begin(face, 2, m), m, to);
      scaling = to;
      parity ^= 1;
    }
  }
}

template <typename A, typename B>
void check_lengths(const HaarLayout& layout, const A& texels, const B& coefficients) {
  const auto expected = static_cast<std::size_t>(layout.size());
  if (texels.size() != expected || coefficients.size() != expected) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("Haar transform: {} texels and {} coefficients, expected {} (6*{}*{})",
                            texels.size(), coefficients.size(), expected, layout.face_size(),
                            layout.face_size()));
  }
}

// Light goes through double, channel by channel.
template <typename Transform>
void by_channel(std::span<const Rgb> in, std::span<Rgb> out, const Transform& transform) {
  thread_local std::vector<double> from, to;
  from.resize(in.size());
  to.resize(in.size());
  for (float Rgb::*channel : {&Rgb::r, &Rgb::g, &Rgb::b}) {
    for (std::size_t i = 0; i < in.size(); ++i) from[i] = static_cast<double>(in[i].*channel);
    transform(from.data(), to.data());
    for (std::size_t i = 0; i < out.size(); ++i) out[i].*channel = static_cast<float>(to[i]);
  }
}

}  // namespace

HaarLayout::HaarLayout(int face_size) : face_size_(face_size) {
  if (face_size < 1 || face_size > 1024 || !std::has_single_bit(static_cast<unsigned>(face_size))) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("face size is {}, expected a power of two from 1 to 1024", face_size));
  }
  band_count_ = std::max(1, std::countr_zero(static_cast<unsigned>(face_size)));
}

IndexRange HaarLayout::band(int b) const {
  return {b == 0 ? 0 : 6 << (2 * b), face_size_ == 1 ? 6 : 6 << (2 * (b + 1))};
}

int HaarLayout::band_of(int index) const {
  if (index < 24) return 0;
  return (std::bit_width(static_cast<unsigned>(index / 6)) - 1) / 2;
}

int HaarLayout::area(int b) const { return (face_size_ * face_size_) >> (2 * b); }

void haar_forward(const HaarLayout& layout, std::span<const float> texels,
                  std::span<float> coefficients) {
  check_lengths(layout, texels, coefficients);
  forward_faces(layout.face_size(), texels.data(), coefficients.data());
}
void haar_forward(const HaarLayout& layout, std::span<const double> texels,
                  std::span<double> coefficients) {
  check_lengths(layout, texels, coefficients);
  forward_faces(layout.face_size(), texels.data(), coefficients.data());
}
void haar_forward(const HaarLayout& layout, std::span<const Rgb> texels,
                  std::span<Rgb> coefficients) {
  check_lengths(layout, texels, coefficients);
  const FlushDenormals flush;
  by_channel(texels, coefficients,
             [&](const double* in, double* out) { forward_faces(layout.face_size(), in, out); });
}

void haar_inverse(const HaarLayout& layout, std::span<const float> coefficients,
                  std::span<float> texels) {
  check_lengths(layout, texels, coefficients);
  inverse_faces(layout.face_size(), coefficients.data(), texels.data());
}
void haar_inverse(const HaarLayout& layout, std::span<const double> coefficients,
                  std::span<double> texels) {
  check_lengths(layout, texels, coefficients);
  inverse_faces(layout.face_size(), coefficients.data(), texels.data());
}
void haar_inverse(const HaarLayout& layout, std::span<const Rgb> coefficients,
                  std::span<Rgb> texels) {
  check_lengths(layout, texels, coefficients);
  by_channel(coefficients, texels,
             [&](const double* in, double* out) { inverse_faces(layout.face_size(), in, out); });
}

}  // namespace haarlight
