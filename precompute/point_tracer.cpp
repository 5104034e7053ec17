// One shading point -> what each texel of distant light contributes to it. The hot loop.
//
//   first pass     a ray through the first sample of every texel above the horizon
//   differences    texels whose visibility differs from a neighbour's need a closer look
//   sure texels    V times the whole texel's cosine (and lobe)
//   refine         sum over samples of V_s f max(0, n.w_s) dw_s

#include "precompute/point_tracer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "core/frame.h"
#include "precompute/glossy_lobe.h"
#include "precompute/incoming_term.h"
#include "precompute/random.h"
#include "precompute/specular_path.h"

namespace haarlight {
namespace {

constexpr int kLobeDraws = 256;

struct FloatVec {
  float x, y, z;
  explicit FloatVec(const Vec3& v)
      : x(static_cast<float>(v.x)), y(static_cast<float>(v.y)), z(static_cast<float>(v.z)) {}
  float dot(float a, float b, float c) const { return x * a + y * b + z * c; }
};

bool get(const std::vector<std::uint64_t>& bits, std::size_t i) {
  return bits[i / 64] >> (i % 64) & 1;
}
void set(std::vector<std::uint64_t>& bits, std::int32_t i) {
  bits[static_cast<std::size_t>(i) / 64] |= std::uint64_t{1} << (i % 64);
}

// The 8 lanes of a packet are two rows of 4 texels that never straddle a word.
void set_lanes(std::vector<std::uint64_t>& bits, const DirectionTable::Packet& p, unsigned lanes) {
  bits[static_cast<std::size_t>(p.top) / 64] |= std::uint64_t{lanes & 15u} << (p.top % 64);
  bits[static_cast<std::size_t>(p.bottom) / 64] |= std::uint64_t{lanes >> 4} << (p.bottom % 64);
}

// bits[i + shift], as a word of bits.
std::uint64_t word_at(const std::vector<std::uint64_t>& bits, std::size_t word, std::size_t shift) {
  const std::size_t w = word + shift / 64, s = shift % 64;
  const std::uint64_t low = w < bits.size() ? bits[w] : 0;
  if (s == 0) return low;
  const std::uint64_t high = w + 1 < bits.size() ? bits[w + 1] : 0;
  return low >> s | high << (64 - s);
}

// Lanes whose dot product of `direction` with `normal` is above `bound`.
unsigned lanes_above(const float* x, const float* y, const float* z, const FloatVec& normal,
                     float bound) {
  float cosine[8];
  for (unsigned i = 0; i < 8; ++i) cosine[i] = normal.dot(x[i], y[i], z[i]);
  unsigned lanes = 0;
  for (unsigned i = 0; i < 8; ++i) lanes |= static_cast<unsigned>(cosine[i] > bound) << i;
  return lanes;
}

}  // namespace

ShadingPoint shading_point(const Receiver& receiver) {
  ShadingPoint point;
  const Bsdf& b = receiver.bsdf;
  const Vec3 origin = receiver.position + Visibility::kSurfaceOffset * b.geometric_normal;
  point.origin = {static_cast<float>(origin.x), static_cast<float>(origin.y),
                  static_cast<float>(origin.z)};
  point.geometric_normal = b.geometric_normal;
  point.normal = b.normal;
  point.glossy = b.has_lobe();
  point.bsdf = b;
  return point;
}

PointTracer::PointTracer(const Visibility& visibility, const DirectionTable& table, bool adaptive,
                         bool shadows)
    : visibility_(visibility), table_(table), adaptive_(adaptive), shadows_(shadows) {
  const std::size_t words = (table.texels() + 63) / 64;
  const auto n = static_cast<std::size_t>(table.n);
  has_right_.assign(words, 0);
  has_below_.assign(words, 0);
  for (std::size_t k = 0; k < table.texels(); ++k) {
    const std::uint64_t bit = std::uint64_t{1} << (k % 64);
    if (k % n + 1 < n) has_right_[k / 64] |= bit;
    if (k / n % n + 1 < n) has_below_[k / 64] |= bit;
  }
}

void PointTracer::first_pass(const ShadingPoint& point, PointScratch& scratch,
                             RayCounts& counts) const {
  const FloatVec normal(point.normal), geometric(point.geometric_normal);
  for (const DirectionTable::Group& g : table_.group) {
    const float n_axis = normal.dot(g.x, g.y, g.z), g_axis = geometric.dot(g.x, g.y, g.z);
    if (n_axis <= -g.radius || g_axis <= -g.radius) continue;
    const bool above = n_axis > g.radius && g_axis > g.radius;
    for (std::int32_t j = g.first; j < g.first + g.count; ++j) {
      const DirectionTable::Packet& p = table_.packet[static_cast<std::size_t>(j)];
      unsigned lanes = 0xff;  // first samples above both horizons
      if (!above) {
        const unsigned touched = lanes_above(p.cx, p.cy, p.cz, normal, -p.radius) &
                                 lanes_above(p.cx, p.cy, p.cz, geometric, -p.radius);
        if (touched == 0) continue;
        const unsigned whole = lanes_above(p.cx, p.cy, p.cz, normal, p.radius) &
                               lanes_above(p.cx, p.cy, p.cz, geometric, p.radius);
        lanes = touched & lanes_above(p.x, p.y, p.z, normal, 0) &
                lanes_above(p.x, p.y, p.z, geometric, 0);
        if (touched != whole) set_lanes(scratch.refine, p, touched & ~whole);
        if (lanes == 0) continue;
      }
      unsigned blocked = 0;
      if (shadows_) {
        blocked = visibility_.occluded8(point.origin, p.x, p.y, p.z, lanes);
        counts.shadow += std::popcount(lanes);
      }
      set_lanes(scratch.known, p, lanes);
      set_lanes(scratch.visible, p, lanes & ~blocked);
    }
  }
}

void PointTracer::mark_differences(PointScratch& scratch) const {
  const std::size_t words = scratch.known.size();
  const auto n = static_cast<std::size_t>(table_.n);
  for (const bool below : {false, true}) {
    const std::size_t shift = below ? n : 1;
    for (std::size_t w = 0; w < words; ++w) {
      if (scratch.known[w] == 0) continue;
      std::uint64_t differs = (scratch.visible[w] ^ word_at(scratch.visible, w, shift)) &
                              scratch.known[w] & word_at(scratch.known, w, shift);
      if (differs == 0) continue;
      differs &= below ? has_below_[w] : has_right_[w];
      scratch.refine[w] |= differs;
      const std::size_t up = w + shift / 64, s = shift % 64;  // the same texels, shifted on
      if (up < words) scratch.refine[up] |= differs << s;
      if (s != 0 && up + 1 < words) scratch.refine[up + 1] |= differs >> (64 - s);
    }
  }
  for (const auto& [a, b] : table_.seam) {
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    if (get(scratch.known, i) && get(scratch.known, j) &&
        get(scratch.visible, i) != get(scratch.visible, j)) {
      set(scratch.refine, a);
      set(scratch.refine, b);
    }
  }
}

void PointTracer::refine(const ShadingPoint& point, const GlossyLobe* lobe, const PointRow& row,
                         PointScratch& scratch, RayCounts& counts) const {
  const FloatVec normal(point.normal), geometric(point.geometric_normal);
  const auto samples = static_cast<std::size_t>(table_.samples);
  const auto inverse_pi = static_cast<float>(1 / kPi);

  // Rays of any texels wait here until there are eight; results are added in the order of arrival.
  alignas(32) float x[8] = {}, y[8] = {}, z[8] = {};
  float diffuse_part[8], first_part[8], second_part[8];
  std::size_t texel_of[8];
  unsigned waiting = 0;
  const auto add = [&](std::size_t texel, float diffuse, float first, float second) {
    row.diffuse[texel] += diffuse;
    if (lobe) row.first[texel] += first, row.second[texel] += second;
  };
  const auto flush = [&] {
    if (waiting == 0) return;
    const unsigned lanes = (1u << waiting) - 1;
    unsigned blocked = 0;
    if (shadows_) {
      blocked = visibility_.occluded8(point.origin, x, y, z, lanes);
      counts.shadow += waiting;
    }
    for (unsigned i = 0; i < waiting; ++i) {
      if (!(blocked >> i & 1u)) add(texel_of[i], diffuse_part[i], first_part[i], second_part[i]);
    }
    waiting = 0;
  };

  for (std::size_t w = 0; w < scratch.refine.size(); ++w) {
    for (std::uint64_t bits = scratch.refine[w]; bits != 0; bits &= bits - 1) {
      const std::size_t texel = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
      const bool lit = lobe && lobe->reaches(texel);
      if (lit) lobe->weights(texel, scratch.first_weights, scratch.second_weights);
      for (std::size_t s = 0; s < samples; ++s) {
        const DirectionTable::Sample& d = table_.sample[texel * samples + s];
        const float cosine = normal.dot(d.x, d.y, d.z);
        if (!(cosine > 0) || !(geometric.dot(d.x, d.y, d.z) > 0)) continue;
        const float diffuse = cosine * d.solid_angle * inverse_pi;
        const float first = lit ? scratch.first_weights[s] : 0.0f;
        const float second = lit ? scratch.second_weights[s] : 0.0f;
        if (s == 0) {  // traced in the first pass
          if (get(scratch.visible, texel)) add(texel, diffuse, first, second);
          continue;
        }
        x[waiting] = d.x, y[waiting] = d.y, z[waiting] = d.z;
        diffuse_part[waiting] = diffuse;
        first_part[waiting] = first, second_part[waiting] = second;
        texel_of[waiting] = texel;
        if (++waiting == 8) flush();
      }
    }
  }
  flush();
}

// A lobe between the samples of texels: even draws from it, each a ray of its own.
void PointTracer::draw_lobe(const ShadingPoint& point, std::vector<Deposit>& deposits,
                            RayCounts& counts) const {
  constexpr double kShift[4] = {0, 0, 0.5, 0.5};
  const Bsdf& b = point.bsdf;
  alignas(32) float x[8] = {}, y[8] = {}, z[8] = {};
  Deposit part[8];
  unsigned waiting = 0;
  const auto flush = [&] {
    if (waiting == 0) return;
    unsigned blocked = 0;
    if (shadows_) {
      blocked = visibility_.occluded8(point.origin, x, y, z, (1u << waiting) - 1);
      counts.shadow += waiting;
    }
    for (unsigned i = 0; i < waiting; ++i) {
      if (!(blocked >> i & 1u)) deposits.push_back(part[i]);
    }
    waiting = 0;
  };
  for (int i = 0; i < kLobeDraws; ++i) {
    const EvenPoint u = even_point(static_cast<std::uint64_t>(i), kShift);
    const auto draw = b.sample_lobe(u.value[2], u.value[3]);
    if (!draw || !(dot(draw->direction, b.geometric_normal) > 0)) continue;
    const Bsdf::LobeValues v = b.lobe_values(draw->direction);
    part[waiting] = {
        texel_of(draw->direction, table_.n),
        (v.first * b.gloss_first + v.second * b.gloss_second) * (1 / (draw->pdf * kLobeDraws))};
    x[waiting] = static_cast<float>(draw->direction.x);
    y[waiting] = static_cast<float>(draw->direction.y);
    z[waiting] = static_cast<float>(draw->direction.z);
    if (++waiting == 8) flush();
  }
  flush();
}

// Which texels are seen, and which need all of their samples.
void PointTracer::look(const ShadingPoint& point, PointScratch& scratch, RayCounts& counts) const {
  const std::size_t words = (table_.texels() + 63) / 64;
  scratch.known.assign(words, 0);
  scratch.visible.assign(words, 0);
  scratch.refine.assign(words, 0);
  ++counts.points;
  first_pass(point, scratch, counts);
  if (adaptive_) {
    if (table_.samples > 1) mark_differences(scratch);
  } else {
    for (std::size_t w = 0; w < words; ++w) scratch.refine[w] |= scratch.known[w];
  }
}

void PointTracer::trace_terms(const ShadingPoint& point, std::span<const IncomingTerm* const> terms,
                              std::span<const std::span<float>> rows, PointScratch& scratch,
                              RayCounts& counts) const {
  look(point, scratch, counts);
  int most_order = 0;
  for (const IncomingTerm* term : terms) most_order = std::max(most_order, std::abs(term->order));
  for (const std::span<float> row : rows) std::fill(row.begin(), row.end(), 0.0f);
  scratch.turns.resize(2 * static_cast<std::size_t>(most_order) + 2);
  float* const cosine_of = scratch.turns.data();
  float* const sine_of = cosine_of + most_order + 1;

  const Frame frame(point.normal);
  const FloatVec x_axis(frame.x), y_axis(frame.y), normal(frame.z),
      geometric(point.geometric_normal);
  const auto samples = static_cast<std::size_t>(table_.samples);
  // What sample `s` of a texel that is seen there is worth.
  const auto add = [&](std::size_t texel, std::size_t s) {
    const DirectionTable::Sample& d = table_.sample[texel * samples + s];
    const float z = normal.dot(d.x, d.y, d.z);
    if (!(z > 0) || !(geometric.dot(d.x, d.y, d.z) > 0)) return;
    const float x = x_axis.dot(d.x, d.y, d.z), y = y_axis.dot(d.x, d.y, d.z);
    const float across = std::sqrt(x * x + y * y);
    const float c = across > 1e-12f ? x / across : 1, si = across > 1e-12f ? y / across : 0;
    cosine_of[0] = 1, sine_of[0] = 0;
    for (int m = 1; m <= most_order; ++m) {
      cosine_of[m] = cosine_of[m - 1] * c - sine_of[m - 1] * si;
      sine_of[m] = sine_of[m - 1] * c + cosine_of[m - 1] * si;
    }
    // 1 - cos theta without its cancellation near the normal.
    const float t = std::sqrt(z > 0.9f ? across * across / (1 + z) : 1 - z);
    for (std::size_t k = 0; k < terms.size(); ++k) {
      const int m = terms[k]->order;
      rows[k][texel] += terms[k]->at(t) * (m >= 0 ? cosine_of[m] : sine_of[-m]) * d.solid_angle;
    }
  };

  alignas(32) float x[8] = {}, y[8] = {}, z[8] = {};
  std::size_t texel_at[8], sample_at[8];
  unsigned waiting = 0;
  const auto flush = [&] {
    if (waiting == 0) return;
    unsigned blocked = 0;
    if (shadows_) {
      blocked = visibility_.occluded8(point.origin, x, y, z, (1u << waiting) - 1);
      counts.shadow += waiting;
    }
    for (unsigned i = 0; i < waiting; ++i) {
      if (!(blocked >> i & 1u)) add(texel_at[i], sample_at[i]);
    }
    waiting = 0;
  };
  for (std::size_t w = 0; w < scratch.known.size(); ++w) {
    for (std::uint64_t bits = scratch.visible[w] & ~scratch.refine[w]; bits != 0;
         bits &= bits - 1) {
      const std::size_t texel = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
      for (std::size_t s = 0; s < samples; ++s) add(texel, s);
    }
    for (std::uint64_t bits = scratch.refine[w]; bits != 0; bits &= bits - 1) {
      const std::size_t texel = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
      if (get(scratch.visible, texel)) add(texel, 0);  // traced in the first pass
      for (std::size_t s = 1; s < samples; ++s) {
        const DirectionTable::Sample& d = table_.sample[texel * samples + s];
        if (!(normal.dot(d.x, d.y, d.z) > 0) || !(geometric.dot(d.x, d.y, d.z) > 0)) continue;
        x[waiting] = d.x, y[waiting] = d.y, z[waiting] = d.z;
        texel_at[waiting] = texel, sample_at[waiting] = s;
        if (++waiting == 8) flush();
      }
    }
  }
  flush();
}

void PointTracer::trace(const ShadingPoint& point, const PointRow& row, PointScratch& scratch,
                        RayCounts& counts) const {
  const std::size_t words = (table_.texels() + 63) / 64;
  scratch.first_weights.resize(static_cast<std::size_t>(table_.samples));
  scratch.second_weights.resize(static_cast<std::size_t>(table_.samples));
  std::fill(row.diffuse.begin(), row.diffuse.end(), 0.0f);
  if (point.glossy) {
    std::fill(row.first.begin(), row.first.end(), 0.0f);
    std::fill(row.second.begin(), row.second.end(), 0.0f);
  }
  look(point, scratch, counts);

  std::optional<GlossyLobe> lobe;
  if (point.glossy) lobe.emplace(table_, point.bsdf);

  // Texels wholly above both horizons, all of one visibility.
  const FloatVec normal(point.normal * (1 / kPi));
  for (std::size_t w = 0; w < words; ++w) {
    const std::uint64_t sure = scratch.visible[w] & ~scratch.refine[w];
    const std::size_t end = std::min(table_.texels(), 64 * w + 64);
    if (sure == 0) continue;
    for (std::size_t k = 64 * w; k < end; ++k) {
      const float whole = normal.dot(table_.moment_x[k], table_.moment_y[k], table_.moment_z[k]);
      row.diffuse[k] = (sure >> (k % 64) & 1) ? whole : 0.0f;
    }
    if (!lobe) continue;
    lobe->whole(64 * w, end - 64 * w, sure, row.first.data() + 64 * w, row.second.data() + 64 * w,
                scratch.first_weights, scratch.second_weights);
  }
  refine(point, lobe ? &*lobe : nullptr, row, scratch, counts);

  if (point.bsdf.coat_f0 > 0) {  // changes slowly: once a texel
    const float least = 1e-3f;   // near the horizon the middle of a texel may lie below it
    const float share =
        point.bsdf.coat_pass > 1e-9 ? static_cast<float>(1 / point.bsdf.coat_pass) : 0;
    const FloatVec up(point.normal);
    scratch.coat.clear();
    const std::int32_t coat = scratch.coat.add(point.bsdf);
    scratch.pass.resize(table_.texels());
    for (std::size_t k = 0; k < table_.texels(); ++k) {
      scratch.pass[k] =
          std::max(least, up.dot(table_.plane_x[k], table_.plane_y[k], table_.plane_z[k]));
    }
    scratch.coat.passing(coat, scratch.pass.data(), table_.texels(), scratch.pass.data());
    for (std::size_t k = 0; k < table_.texels(); ++k) row.diffuse[k] *= share * scratch.pass[k];
  }
  if (lobe && lobe->is_narrow() && row.deposits) draw_lobe(point, *row.deposits, counts);
}

void PointTracer::trace(const ShadingPoint& point, std::span<float> lambert, std::span<float> lobe,
                        PointScratch& scratch, RayCounts& counts) const {
  if (point.glossy) scratch.second.resize(table_.texels());
  PointRow row;
  row.diffuse = lambert;
  row.first = lobe;
  row.second = scratch.second;
  trace(point, row, scratch, counts);
}

void PointTracer::trace_caustics(const Scene& scene, const ShadingPoint& point,
                                 PointScratch& scratch, std::vector<Deposit>& deposits,
                                 RayCounts& counts) const {
  const Bsdf& b = point.bsdf;
  const auto samples = static_cast<std::size_t>(table_.samples);
  const Vec3 origin{static_cast<double>(point.origin[0]), static_cast<double>(point.origin[1]),
                    static_cast<double>(point.origin[2])};
  std::optional<GlossyLobe> lobe;
  if (point.glossy) lobe.emplace(table_, b);

  // What comes along `w`, by way of the mirror or glass nearest there, times `value`.
  const auto follow = [&](const Vec3& w, const RgbD& value, std::uint64_t key) {
    ++counts.specular;
    const auto hit = surface_hit(scene, visibility_, origin, w);
    if (!hit) return;
    const Material& material = scene.material[hit->material];
    const SingleDirections met = is_mirror_or_glass(material)
                                     ? SingleDirections(material, *hit)
                                     : SingleDirections(bsdf_at(scene, *hit));
    if (met.delta_count == 0) return;
    PathRandom random(key);
    const PathEnd end =
        follow_specular(scene, visibility_, *hit, met, AtMixed::pass, random, counts.specular);
    if (end.hit || !(luminance(end.weight) > 0)) return;
    deposits.push_back({texel_of(end.direction, table_.n), value * end.weight});
  };

  alignas(32) float x[8] = {}, y[8] = {}, z[8] = {};
  RgbD value[8];
  std::uint64_t key[8] = {};
  unsigned waiting = 0;
  const auto flush = [&] {
    if (waiting == 0) return;
    const unsigned lanes = (1u << waiting) - 1;
    counts.specular += waiting;
    const unsigned met = visibility_.occluded8(point.origin, x, y, z, lanes, Visibility::kSpecular);
    for (unsigned i = 0; i < waiting; ++i) {
      if (met >> i & 1u) {
        follow({static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])},
               value[i], key[i]);
      }
    }
    waiting = 0;
  };
  const RgbD out = b.diffuse_out(b.to_viewer);
  const auto wait = [&](const Vec3& w, const RgbD& v, std::uint64_t k) {
    x[waiting] = static_cast<float>(w.x), y[waiting] = static_cast<float>(w.y);
    z[waiting] = static_cast<float>(w.z);
    value[waiting] = v, key[waiting] = k;
    if (++waiting == 8) flush();
  };
  for (std::size_t w = 0; w < scratch.known.size(); ++w) {
    const std::uint64_t open = (scratch.known[w] & ~scratch.visible[w]) | scratch.refine[w];
    for (std::uint64_t bits = open; bits != 0; bits &= bits - 1) {
      const std::size_t texel = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
      const bool lit = lobe && lobe->reaches(texel);
      if (lit) lobe->weights(texel, scratch.first_weights, scratch.second_weights);
      for (std::size_t s = 0; s < samples; ++s) {
        const DirectionTable::Sample& d = table_.sample[texel * samples + s];
        const Vec3 direction{static_cast<double>(d.x), static_cast<double>(d.y),
                             static_cast<double>(d.z)};
        if (!(dot(direction, point.normal) > 0) || !(dot(direction, point.geometric_normal) > 0)) {
          continue;
        }
        RgbD v = out * (b.diffuse_in(direction) * static_cast<double>(d.solid_angle));
        if (lit) {
          v += static_cast<double>(scratch.first_weights[s]) * b.gloss_first +
               static_cast<double>(scratch.second_weights[s]) * b.gloss_second;
        }
        if (l1_norm(v) > 0) wait(direction, v, mix_bits(texel, s));
      }
    }
  }
  flush();
  if (!lobe || !lobe->is_narrow()) return;
  constexpr double kShift[4] = {0, 0, 0.5, 0.5};
  for (int i = 0; i < kLobeDraws; ++i) {
    const EvenPoint u = even_point(static_cast<std::uint64_t>(i), kShift);
    const auto draw = b.sample_lobe(u.value[2], u.value[3]);
    if (!draw || !(dot(draw->direction, b.geometric_normal) > 0)) continue;
    const Bsdf::LobeValues v = b.lobe_values(draw->direction);
    wait(draw->direction,
         (v.first * b.gloss_first + v.second * b.gloss_second) * (1 / (draw->pdf * kLobeDraws)),
         mix_bits(table_.texels(), static_cast<std::uint64_t>(i)));
  }
  flush();
}

}  // namespace haarlight
