// Records of incoming radiance.

#include "caching/radiance_record.h"

#include <algorithm>
#include <cmath>

#include "caching/irradiance_record.h"

namespace haarlight {
namespace {

void add(std::vector<float>& to, const std::vector<float>& from, float s) {
  if (from.empty()) return;
  to.resize(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) to[i] += s * from[i];
}

void add_light(std::vector<float>& to, const Harmonics& h, const RgbD& light) {
  if (light == RgbD{}) return;
  const Rgb c(light);
  for (std::size_t i = 0; i < kHarmonics; ++i) {
    to[3 * i] += h[i] * c.r, to[3 * i + 1] += h[i] * c.g, to[3 * i + 2] += h[i] * c.b;
  }
}

constexpr double kLowest = 0.02;  // cosine of what lobes are looked up for

double mean_of(const std::vector<float>& c) {
  return c.empty() ? 0 : static_cast<double>(luminance(Rgb{c[0], c[1], c[2]}));
}
double slope_of(const RadianceValue& v) {
  return std::hypot(mean_of(v.along_x), mean_of(v.along_y));
}

}  // namespace

RadianceValue& RadianceValue::operator+=(const RadianceValue& o) {
  add(coefficient, o.coefficient, 1), add(along_x, o.along_x, 1), add(along_y, o.along_y, 1);
  return *this;
}

RadianceValue operator*(const RadianceValue& a, double s) {
  RadianceValue out;
  const auto f = static_cast<float>(s);
  add(out.coefficient, a.coefficient, f);
  add(out.along_x, a.along_x, f), add(out.along_y, a.along_y, f);
  return out;
}

RadianceValue radiance_value(const Hemisphere& h) {
  RadianceValue out;
  for (auto* v : {&out.coefficient, &out.along_x, &out.along_y}) v->assign(3 * kHarmonics, 0);
  const double share = 2 * kPi / (h.rings * h.sectors), width = 2 * kPi / h.sectors;
  const auto direction = [](double cosine, double phi) {
    const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
    return Vec3{sine * std::cos(phi), sine * std::sin(phi), cosine};
  };
  const auto move = [&](const Vec3& border, double phi, const RgbD& light) {
    if (light == RgbD{}) return;
    const Harmonics basis = hemispherical_harmonics(border);
    add_light(out.along_x, basis, light * std::cos(phi));
    add_light(out.along_y, basis, light * std::sin(phi));
  };
  for (int j = 0; j < h.rings; ++j) {
    const double high = 1 - static_cast<double>(j) / h.rings, low = 1 - (j + 1.0) / h.rings;
    for (int k = 0; k < h.sectors; ++k) {
      const std::size_t i = h.number(j, k);
      const RgbD& light = h.radiance[i];
      add_light(out.coefficient, hemispherical_harmonics(h.direction[i]), light * share);
      // A border sweeps solid angle: sin cos dphi / r where theta moves, dtheta / r where phi does.
      if (j > 0) {
        const std::size_t inner = h.number(j - 1, k);
        const double near = nearer_distance(h.distance[i], h.distance[inner]);
        const double sine = std::sqrt(1 - high * high), phi = width * (k + 0.5);
        move(direction(high, phi), phi, (light - h.radiance[inner]) * (sine * high * width / near));
      }
      const std::size_t side = h.number(j, (k + h.sectors - 1) % h.sectors);
      const double near = nearer_distance(h.distance[i], h.distance[side]);
      const double phi = width * k;
      move(direction((low + high) / 2, phi), phi + kPi / 2,
           (light - h.radiance[side]) * ((std::acos(low) - std::acos(high)) / near));
    }
  }
  return out;
}

RadianceValue coefficients_of(const Hemisphere& then, const Hemisphere& now,
                              const RadianceValue& value) {
  RadianceValue out;
  out.coefficient = value.coefficient;
  const double share = 2 * kPi / (now.rings * now.sectors);
  for (std::size_t i = 0; i < now.direction.size(); ++i) {
    if (then.radiance[i] == now.radiance[i]) continue;
    add_light(out.coefficient, hemispherical_harmonics(now.direction[i]),
              (then.radiance[i] - now.radiance[i]) * share);
  }
  return out;
}

double record_radius(const RadianceValue& value, double mean_distance, double least, double most) {
  return reach_of(mean_of(value.coefficient), slope_of(value), mean_distance, least, most);
}

RadianceValue limited(RadianceValue value, double radius) {
  const auto share =
      static_cast<float>(share_kept(mean_of(value.coefficient), slope_of(value), radius));
  for (float& x : value.along_x) x *= share;
  for (float& x : value.along_y) x *= share;
  return value;
}

double temporal_ratio(const RadianceValue& now, const RadianceValue& next, const LobeView& view,
                      const LobeHarmonics& lobes) {
  constexpr double kOff = 0.2;
  const auto light = [](const Harmonics& f, const RadianceValue& value) {
    RgbD sum;
    if (value.coefficient.empty()) return sum;
    for (std::size_t i = 0; i < kHarmonics; ++i) {
      const float* c = &value.coefficient[3 * i];
      sum += RgbD(Rgb{c[0], c[1], c[2]}) * static_cast<double>(f[i]);
    }
    return RgbD{std::max(sum.r, 0.0), std::max(sum.g, 0.0), std::max(sum.b, 0.0)};
  };
  const Vec3 o = view.to_viewer;
  const double away = std::max(std::hypot(o.x, o.y), 1e-9);
  const Vec3 across = away > 1e-9 ? Vec3{-o.y / away, o.x / away, 0} : Vec3{0, 1, 0};
  const Vec3 up = cross(o, across);
  RgbD before, after, change;
  for (int n = 0; n < 5; ++n) {
    Vec3 to = o;
    if (n > 0) to = to + (n < 3 ? across : up) * (n % 2 == 0 ? kOff : -kOff);
    to.z = std::max(to.z, kLowest);
    // The lobe as it is seen from there; its mirror direction is as far off.
    const Harmonics f = lobes.at(view.table, normalize(to)).first;
    const RgbD a = light(f, now), b = light(f, next);
    before += a, after += b;
    change += RgbD{std::abs(b.r - a.r), std::abs(b.g - a.g), std::abs(b.b - a.b)};
  }
  const RgbD least{std::min(before.r, after.r), std::min(before.g, after.g),
                   std::min(before.b, after.b)};
  return temporal_ratio(least, least + change);
}

RgbD lobe_radiance(const PlaceFrame& at, const RadianceValue& value, const Vec3& position,
                   const Bsdf& bsdf, std::int32_t table, const LobeHarmonics& lobes) {
  if (value.coefficient.empty()) return {};
  const Vec3& n = bsdf.normal;
  const Vec3 mirror = n * (2 * dot(n, bsdf.to_viewer)) - bsdf.to_viewer;
  Vec3 r = at.to_local(mirror);
  // Below the record's horizon, as at the rim of a ball: the lobe lies on it.
  if (r.z < kLowest) {
    r.z = kLowest;
    r = normalize(r);
  }
  const LobeHarmonics::Pair f = lobes.at(table, {-r.x, -r.y, r.z});
  const Vec3 way = position - at.position;
  const auto x = static_cast<float>(dot(way, at.tangent));
  const auto y = static_cast<float>(dot(way, at.bitangent));
  RgbD first, second;
  for (std::size_t i = 0; i < kHarmonics; ++i) {
    const auto light = [&](std::size_t c) {
      const std::size_t k = 3 * i + c;
      return static_cast<double>(value.coefficient[k] + x * value.along_x[k] +
                                 y * value.along_y[k]);
    };
    const RgbD l{light(0), light(1), light(2)};
    first += l * static_cast<double>(f.first[i]);
    second += l * static_cast<double>(f.second[i]);
  }
  const RgbD sum = bsdf.gloss_first * first + bsdf.gloss_second * second;
  return {std::max(sum.r, 0.0), std::max(sum.g, 0.0), std::max(sum.b, 0.0)};
}

}  // namespace haarlight
