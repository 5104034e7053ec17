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

RgbD lobe_radiance(const PlaceFrame& at, const RadianceValue& value, const Vec3& position,
                   const Bsdf& bsdf, std::int32_t table, const LobeHarmonics& lobes) {
  if (value.coefficient.empty()) return {};
  const Vec3& n = bsdf.normal;
  const Vec3 mirror = n * (2 * dot(n, bsdf.to_viewer)) - bsdf.to_viewer;
  Vec3 r = at.to_local(mirror);
  // Below the record's horizon, as at the rim of a ball: the lobe lies on it.
  constexpr double kLowest = 0.02;
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
