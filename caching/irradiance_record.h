// What a record of an irradiance cache holds, and what it says about a place nearby.

#pragma once

#include <cstdint>

#include "caching/body_place.h"
#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// Irradiance (W/m^2) at a place and how it changes there. Gradients are in the plane of the
/// tangents of a PlaceFrame, x along `tangent`. All of it is linear in the incoming light.
struct RecordValue {
  RgbD irradiance;
  RgbD rotation_x, rotation_y;        ///< a radian (Ward and Heckbert 1992)
  RgbD translation_x, translation_y;  ///< a metre

  RecordValue& operator+=(const RecordValue& o);
  friend RecordValue operator+(RecordValue a, const RecordValue& b) { return a += b; }
  friend RecordValue operator*(const RecordValue& a, double s);
  friend RecordValue operator-(const RecordValue& a, const RecordValue& b) { return a + b * -1; }
};

/// Ward's error of using a record at `at` for a place `position` of unit `normal`:
/// |p - p_K| / radius + sqrt(1 - n . n_K) (Gautron 2007, equation 2, of which it is the inverse).
/// Infinite where the place lies in front of the record, so that what it sees is not what the
/// record saw (Ward 1988), and for radius <= 0 unless it is the place itself.
double record_error(const PlaceFrame& at, double radius, const Vec3& position, const Vec3& normal);

/// Weight of a record of that error in the mean of equation 1: 1 / error - 1 / accuracy, so that a
/// record fades in where it begins to count, capped; 0 from `accuracy` on (equation 3).
double record_weight(double error, double accuracy);

/// The irradiance at a place by a record (equation 4), in [1/20, 20] of the record's own, a channel
/// at a time: a gradient must not make light negative or a corner a lamp. `shading` is the unit
/// normal the light is wanted for, which may be bumped.
RgbD extrapolated(const PlaceFrame& at, const RecordValue& value, const Vec3& position,
                  const Vec3& shading);

/// Of any quantity of light and its slope, its change a metre along its translation gradient: the
/// radius of record_radius(), and what share of the gradient limited() keeps.
double reach_of(double light, double slope, double mean_distance, double least, double most);
double share_kept(double light, double slope, double radius);

/// The radius of a record whose harmonic mean distance is `mean_distance` (metres, may be 0 or
/// infinite): not beyond where the translation gradient would have used up the irradiance, nor
/// outside [least, most], metres, 0 < least <= most.
double record_radius(const RecordValue& value, double mean_distance, double least, double most);

/// The value with its translation gradient cut to what cannot use up the irradiance within
/// `radius`.
RecordValue limited(RecordValue value, double radius);

}  // namespace haarlight
