// Weights and gradients of records.

#include "caching/irradiance_record.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "caching/record_cache.h"

namespace haarlight {

RecordValue& RecordValue::operator+=(const RecordValue& o) {
  irradiance += o.irradiance;
  rotation_x += o.rotation_x, rotation_y += o.rotation_y;
  translation_x += o.translation_x, translation_y += o.translation_y;
  return *this;
}

RecordValue operator*(const RecordValue& a, double s) {
  return {a.irradiance * s, a.rotation_x * s, a.rotation_y * s, a.translation_x * s,
          a.translation_y * s};
}

double record_error(const PlaceFrame& at, double radius, const Vec3& position, const Vec3& normal) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const Vec3 way = position - at.position;
  const double distance = length(way);
  const double turn = std::sqrt(std::max(1 - dot(normal, at.normal), 0.0));
  if (distance == 0) return turn;
  if (!(radius > 0)) return kNone;
  // Half a hundredth of the radius: curved bodies of flat triangles are not all "in front".
  if (dot(way, at.normal + normal) < -0.01 * radius) return kNone;
  return distance / radius + turn;
}

double record_weight(double error, double accuracy) {
  constexpr double kMost = 1e6;
  if (!(error < accuracy)) return 0;
  return std::min(1 / std::max(error, 1 / kMost) - 1 / accuracy, kMost);
}

RgbD extrapolated(const PlaceFrame& at, const RecordValue& value, const Vec3& position,
                  const Vec3& shading) {
  constexpr double kMost = 20;
  const Vec3 way = position - at.position, turn = cross(at.normal, shading);
  const RgbD sum = value.irradiance + value.rotation_x * dot(turn, at.tangent) +
                   value.rotation_y * dot(turn, at.bitangent) +
                   value.translation_x * dot(way, at.tangent) +
                   value.translation_y * dot(way, at.bitangent);
  const auto kept = [](double x, double own) {
    own = std::max(own, 0.0);
    return std::clamp(x, own / kMost, own * kMost);
  };
  return {kept(sum.r, value.irradiance.r), kept(sum.g, value.irradiance.g),
          kept(sum.b, value.irradiance.b)};
}

namespace {

double slope_of(const RecordValue& value) {
  return std::hypot(luminance(value.translation_x), luminance(value.translation_y));
}

}  // namespace

double reach_of(double light, double slope, double mean_distance, double least, double most) {
  double radius = mean_distance;
  if (slope > 0) radius = std::min(radius, light / slope);
  if (std::isnan(radius)) radius = least;
  return std::clamp(radius, least, most);
}

double share_kept(double light, double slope, double radius) {
  const double used = slope * radius, whole = std::max(light, 0.0);
  return used > whole ? whole / used : 1;
}

double record_radius(const RecordValue& value, double mean_distance, double least, double most) {
  return reach_of(luminance(value.irradiance), slope_of(value), mean_distance, least, most);
}

RecordValue limited(RecordValue value, double radius) {
  const double share = share_kept(luminance(value.irradiance), slope_of(value), radius);
  value.translation_x *= share;
  value.translation_y *= share;
  return value;
}

FoundIrradiance irradiance_at(const RecordCache<RecordValue>& cache, const Vec3& position,
                              const Vec3& normal, const Vec3& shading) {
  FoundIrradiance found;
  double weights = 0;
  found.left =
      cache.visit(position, normal, [&](const PlaceFrame& at, const RecordValue& value, double w) {
        found.irradiance += extrapolated(at, value, position, shading) * w;
        weights += w;
      });
  if (weights > 0) found.irradiance *= 1 / weights;
  return found;
}

}  // namespace haarlight
