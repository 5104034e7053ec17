// Records of incoming radiance for glossy surfaces: Krivanek and others 2005.

#pragma once

#include <vector>

#include "caching/hemisphere.h"
#include "caching/hemispherical_harmonics.h"
#include "caching/lobe_harmonics.h"
#include "caching/temporal_weight.h"

namespace haarlight {

/// Coefficients of incoming radiance in hemispherical harmonics about a PlaceFrame, and how they
/// change a metre along its tangents: kHarmonics times RGB, one after the other. Linear in light;
/// an empty one is zero.
struct RadianceValue {
  std::vector<float> coefficient, along_x, along_y;

  RadianceValue& operator+=(const RadianceValue& o);
  friend RadianceValue operator+(RadianceValue a, const RadianceValue& b) { return a += b; }
  friend RadianceValue operator*(const RadianceValue& a, double s);
  friend RadianceValue operator-(const RadianceValue& a, const RadianceValue& b) {
    return a + b * -1;
  }
};

/// By a hemisphere of even strata (Hemisphere::even). Gradients by how borders between strata move,
/// as those of irradiance.
RadianceValue radiance_value(const Hemisphere& hemisphere);

/// Coefficients alone of `then`, the same strata of other light, by those of `now`, whose are
/// `value`.
RadianceValue coefficients_of(const Hemisphere& then, const Hemisphere& now,
                              const RadianceValue& value);

/// As record_radius() of irradiance records, by the mean radiance; as limited(), likewise.
double record_radius(const RadianceValue& value, double mean_distance, double least, double most);
RadianceValue limited(RadianceValue value, double radius);

/// Who asked for a record: a lobe, and where it is seen from.
struct LobeView {
  std::int32_t table = 0;  ///< lobe_table_key()
  Vec3 to_viewer;          ///< unit, in the record's PlaceFrame
};

/// The temporal radiance ratio of a record that is `now` and will be `next`: 1 plus the change of
/// what a lobe shows, as a share of it, the largest of the channels. The lobe is looked at in its
/// mirror direction and, because neighbours of other normals use the record, four about it, 0.2
/// radians off; changes are summed by amount. Equation 21 compares coefficients one by one, each as
/// a share of itself: any may be near 0, and those of high order are mostly noise, which no lobe
/// shows.
double temporal_ratio(const RadianceValue& now, const RadianceValue& next, const LobeView& view,
                      const LobeHarmonics& lobes);

/// What a lobe (unit shading normal, viewer in the world) sends to its viewer by a record at
/// another place: the lobe is turned so that its mirror direction is right and its normal the
/// record's; `table` is its lobe_table_key(). At least 0. Nothing if the mirror direction is below
/// the record's horizon.
RgbD lobe_radiance(const PlaceFrame& at, const RadianceValue& value, const Vec3& position,
                   const Bsdf& bsdf, std::int32_t table, const LobeHarmonics& lobes);

}  // namespace haarlight
