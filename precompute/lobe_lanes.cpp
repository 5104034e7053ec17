// Lobes and coats at many directions at once, in single precision.

#include "precompute/lobe_lanes.h"

#include <algorithm>
#include <cmath>

#include "core/simd.h"
#include "precompute/ggx.h"
#include "precompute/lanes.h"

namespace haarlight {
namespace {

using namespace lanes;

constexpr float kPiF = static_cast<float>(kPi);

// A lobe: normal, direction to the viewer or mirror direction, and numbers of its kind.
struct GgxLane {
  Vec8 n, o;
  Eight no, no_root, alpha;
};
struct PhongLane {
  Vec8 n, mirror;
  Eight exponent;
};

// D V n.w times 1 - s and s, as ggx_times_cosine() has it.
HAARLIGHT_LANES void ggx(const GgxLane& g, const Vec8& w, Eight& first, Eight& second) {
  const Eight nw = dot(g.n, w);
  const Vec8 sum{w.x + g.o.x, w.y + g.o.y, w.z + g.o.z};
  const Eight square = dot(sum, sum);
  const Eight inverse = inverse_root(square > 1e-20f ? square : all(1e-20f));
  const Vec8 h{sum.x * inverse, sum.y * inverse, sum.z * inverse};
  const Vec8 across{g.n.y * h.z - g.n.z * h.y, g.n.z * h.x - g.n.x * h.z,
                    g.n.x * h.y - g.n.y * h.x};
  const Eight a2 = g.alpha * g.alpha, nh = dot(g.n, h);
  const Eight spread = a2 * nh * nh + dot(across, across);
  const Eight nw_root = root(a2 + (1 - a2) * nw * nw);
  const Eight below = kPiF * spread * spread * (g.no * nw_root + nw * g.no_root);
  const Eight value = 0.5f * a2 * nw / below;
  const Eight c = above_zero(1 - above_zero(dot(w, h)));
  const Eight s = c * c * (c * c) * c;
  const EightInts up = (nw > 0) & (g.no >= 0) & (g.alpha > 0);
  first = up ? value * (1 - s) : all(0);
  second = up ? value * s : all(0);
}

// 2^v, v <= 0, by Taylor's series over half an octave each way: within 3e-7.
HAARLIGHT_LANES Eight power_of_two(Eight v) {
  const Eight within = v > -120 ? v : all(-120);
  const EightInts nearest = whole(within - 0.5f);
  const Eight f = (within - floats_of(nearest)) * 0.69314718f;
  const Eight series =
      1 + f * (1 + f * (0.5f + f * (1.f / 6 + f * (1.f / 24 + f * (1.f / 120 + f * (1.f / 720))))));
  return floats_in((nearest + 127) << 23) * series;
}

// log2(1 - b), 0 <= b <= 1: 1 - b = m 2^e with m in [sqrt(1/2), sqrt(2)), and the logarithm of m by
// the series of atanh((m - 1) / (m + 1)), where b itself serves as 1 - m while e is 0.
HAARLIGHT_LANES Eight log2_one_minus(Eight b) {
  const Eight rest = 1 - b;
  const EightInts bits = bits_of(rest > 1e-30f ? rest : all(1e-30f));
  const EightInts e = (bits - 0x3f3504f3) >> 23;
  const Eight m = floats_in(bits - (e << 23));
  const Eight beyond = e == 0 ? -b : m - 1;
  const Eight s = beyond / (2 + beyond), q = s * s;
  const Eight series = s * (2 + q * (2.f / 3 + q * (2.f / 5 + q * (2.f / 7 + q * (2.f / 9)))));
  return floats_of(e) + series * 1.44269504f;
}

// (e + 2) / (2 pi) cos^e n.w, cos = 1 - chord^2 / 2 to the mirror direction.
HAARLIGHT_LANES Eight phong(const PhongLane& p, const Vec8& w) {
  const Eight nw = dot(p.n, w);
  const Vec8 chord{w.x - p.mirror.x, w.y - p.mirror.y, w.z - p.mirror.z};
  const Eight below = 0.5f * dot(chord, chord);
  const Eight power = power_of_two(p.exponent * log2_one_minus(at_most_one(below)));
  const EightInts up = (nw > 0) & (below < 1) & (p.exponent >= 0);
  return up ? (p.exponent + 2) * (0.5f / kPiF) * power * nw : all(0);
}

// 1 - C by a coat's albedo between two nodes of its table, each lane's at table[lane].
HAARLIGHT_LANES Eight passing_lanes(const float* const* table, Eight f0, Eight cosine) {
  constexpr auto kLast = static_cast<std::int32_t>(kAlbedoNodes) - 1;
  const Eight at = root(at_most_one(above_zero(cosine))) * static_cast<float>(kLast);
  EightInts i = whole(at);
  i = i < kLast ? i : kLast - 1 + EightInts{};
  const Eight f = at - floats_of(i);
  Eight first{}, second{}, first_next{}, second_next{};
  for (std::size_t lane = 0; lane < 8; ++lane) {
    const float* node = table[lane] + 2 * i[lane];
    first[lane] = node[0], second[lane] = node[1];
    first_next[lane] = node[2], second_next[lane] = node[3];
  }
  first = first * (1 - f) + first_next * f;
  second = second * (1 - f) + second_next * f;
  const Eight sum = first + second;
  const Eight albedo = (f0 * first + second) * (1 + f0 * (1 - sum) / sum);
  return 1 - at_most_one(above_zero(albedo));
}

HAARLIGHT_MULTIVERSION
void passing_of_one(const float* nodes, float f0, const float* cosine, std::size_t count,
                    float* out) {
  const float* table[8];
  for (const float*& t : table) t = nodes;
  for (std::size_t i = 0; i < count; i += 8) {
    store(out + i, passing_lanes(table, all(f0), load(cosine + i)));
  }
}

HAARLIGHT_MULTIVERSION
void passing_of_many(const float* nodes, const float* f0, const std::int32_t* coat,
                     const float* cosine, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; i += 8) {
    const float* table[8];
    Eight reflectance{};
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const auto number = static_cast<std::size_t>(coat[i + lane]);
      table[lane] = nodes + number * 2 * kAlbedoNodes;
      reflectance[lane] = f0[number];
    }
    store(out + i, passing_lanes(table, reflectance, load(cosine + i)));
  }
}

HAARLIGHT_MULTIVERSION
void ggx_of_one(const float (&c)[9], std::size_t count, const float* x, const float* y,
                const float* z, float* first, float* second) {
  const GgxLane lobe{{all(c[0]), all(c[1]), all(c[2])},
                     {all(c[3]), all(c[4]), all(c[5])},
                     all(c[6]),
                     all(c[7]),
                     all(c[8])};
  for (std::size_t i = 0; i < count; i += 8) {
    Eight a, b;
    ggx(lobe, load(x + i, y + i, z + i), a, b);
    store(first + i, a), store(second + i, b);
  }
}

HAARLIGHT_MULTIVERSION
void phong_of_one(const float (&c)[7], std::size_t count, const float* x, const float* y,
                  const float* z, float* first) {
  const PhongLane lobe{
      {all(c[0]), all(c[1]), all(c[2])}, {all(c[3]), all(c[4]), all(c[5])}, all(c[6])};
  for (std::size_t i = 0; i < count; i += 8) {
    store(first + i, phong(lobe, load(x + i, y + i, z + i)));
  }
}

// The arrays of LobeLanes, from the first lane on.
struct Lanes {
  const float *nx, *ny, *nz, *ox, *oy, *oz, *cosine, *root, *alpha, *exponent;
};

HAARLIGHT_MULTIVERSION
void ggx_of_many(const Lanes& l, std::size_t count, const float* x, const float* y, const float* z,
                 float* first, float* second) {
  for (std::size_t i = 0; i < count; i += 8) {
    const GgxLane lobe{load(l.nx + i, l.ny + i, l.nz + i), load(l.ox + i, l.oy + i, l.oz + i),
                       load(l.cosine + i), load(l.root + i), load(l.alpha + i)};
    Eight a, b;
    ggx(lobe, load(x + i, y + i, z + i), a, b);
    store(first + i, a), store(second + i, b);
  }
}

HAARLIGHT_MULTIVERSION
void add_phong_of_many(const Lanes& l, std::size_t count, const float* x, const float* y,
                       const float* z, float* first) {
  for (std::size_t i = 0; i < count; i += 8) {
    const PhongLane lobe{load(l.nx + i, l.ny + i, l.nz + i), load(l.ox + i, l.oy + i, l.oz + i),
                         load(l.exponent + i)};
    store(first + i, load(first + i) + phong(lobe, load(x + i, y + i, z + i)));
  }
}

float to_float(double x) { return static_cast<float>(x); }

Vec3 mirrored(const Bsdf& b) {
  return normalize(2 * dot(b.normal, b.to_viewer) * b.normal - b.to_viewer);
}

double smith_root(double cosine, double alpha) {
  return std::sqrt(alpha * alpha + (1 - alpha * alpha) * cosine * cosine);
}

}  // namespace

void CoatTables::clear() {
  coats_.assign(1, {-1, -1});
  // Albedo 0 where f0 and both parts' weights are: first 1, second 0.
  nodes_.clear();
  for (std::size_t i = 0; i < kAlbedoNodes; ++i) nodes_.insert(nodes_.end(), {1.0f, 0.0f});
  f0_.assign(1, 0.0f);
}

std::int32_t CoatTables::add(const Bsdf& bsdf) {
  if (!(bsdf.coat_f0 > 0)) return kNone;
  for (std::size_t i = coats_.size(); i-- > 1;) {
    if (coats_[i].f0 == bsdf.coat_f0 && coats_[i].alpha == bsdf.width) {
      return static_cast<std::int32_t>(i);
    }
  }
  coats_.push_back({bsdf.coat_f0, bsdf.width});
  f0_.push_back(to_float(bsdf.coat_f0));
  const std::size_t at = nodes_.size();
  nodes_.resize(at + 2 * kAlbedoNodes);
  ggx_albedo_nodes(bsdf.width,
                   std::span<float, 2 * kAlbedoNodes>(nodes_.data() + at, 2 * kAlbedoNodes));
  return static_cast<std::int32_t>(coats_.size()) - 1;
}

void CoatTables::passing(const std::int32_t* coat, const float* cosine, std::size_t count,
                         float* out) const {
  if (size() == 1) {
    std::fill_n(out, count, 1.0f);
    return;
  }
  passing_of_many(nodes_.data(), f0_.data(), coat, cosine, count, out);
}

void CoatTables::passing(std::int32_t coat, const float* cosine, std::size_t count,
                         float* out) const {
  if (coat == kNone) {
    std::fill_n(out, count, 1.0f);
    return;
  }
  const auto at = static_cast<std::size_t>(coat);
  passing_of_one(nodes_.data() + 2 * kAlbedoNodes * at, f0_[at], cosine, count, out);
}

void LobeLanes::clear() {
  size_ = 0;
  for (std::vector<float>& v : of_) v.clear();
  ggx_ = phong_ = false;
}

void LobeLanes::add(const Bsdf& b, bool wanted) {
  const bool ggx = wanted && b.lobe == Bsdf::Lobe::ggx;
  const bool phong = wanted && b.lobe == Bsdf::Lobe::phong;
  const Vec3 other = phong ? mirrored(b) : b.to_viewer;
  const double cosine = dot(b.normal, b.to_viewer);
  const double values[kNumbers] = {b.normal.x,
                                   b.normal.y,
                                   b.normal.z,
                                   other.x,
                                   other.y,
                                   other.z,
                                   cosine,
                                   ggx ? smith_root(cosine, b.width) : 1,
                                   ggx ? b.width : 0,
                                   phong ? b.width : -1};
  for (std::size_t k = 0; k < kNumbers; ++k) {
    // Whole packets of lanes; those to come have no lobe.
    if (size_ % 8 == 0) of_[k].resize(size_ + 8, k == kNumbers - 1 ? -1.0f : 0.0f);
    of_[k][size_] = to_float(values[k]);
  }
  ++size_;
  ggx_ = ggx_ || ggx;
  phong_ = phong_ || phong;
}

void LobeLanes::values(std::size_t begin, std::size_t count, const float* x, const float* y,
                       const float* z, float* first, float* second) const {
  const auto at = [&](std::size_t k) { return of_[k].data() + begin; };
  const Lanes lanes{at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8), at(9)};
  if (ggx_) {
    ggx_of_many(lanes, count, x, y, z, first, second);
  } else {
    std::fill_n(first, count, 0.0f);
    std::fill_n(second, count, 0.0f);
  }
  if (phong_) add_phong_of_many(lanes, count, x, y, z, first);
}

void lobe_values(const Bsdf& b, std::size_t count, const float* x, const float* y, const float* z,
                 float* first, float* second) {
  const float nx = to_float(b.normal.x), ny = to_float(b.normal.y), nz = to_float(b.normal.z);
  if (b.lobe == Bsdf::Lobe::ggx) {
    const double cosine = dot(b.normal, b.to_viewer);
    const float c[9] = {nx,
                        ny,
                        nz,
                        to_float(b.to_viewer.x),
                        to_float(b.to_viewer.y),
                        to_float(b.to_viewer.z),
                        to_float(cosine),
                        to_float(smith_root(cosine, b.width)),
                        to_float(b.width)};
    ggx_of_one(c, count, x, y, z, first, second);
    return;
  }
  std::fill_n(second, count, 0.0f);
  if (b.lobe == Bsdf::Lobe::none) {
    std::fill_n(first, count, 0.0f);
    return;
  }
  const Vec3 mirror = mirrored(b);
  const float c[7] = {
      nx, ny, nz, to_float(mirror.x), to_float(mirror.y), to_float(mirror.z), to_float(b.width)};
  phong_of_one(c, count, x, y, z, first);
}

}  // namespace haarlight
