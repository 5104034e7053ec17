// One shading point -> what each texel of distant light contributes to it. The hot loop.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/vec.h"
#include "precompute/direction_table.h"
#include "precompute/visibility.h"

namespace haarlight {

class PhongLobe;

/// Where light is gathered. Both normals are unit and on the viewer's side.
struct ShadingPoint {
  std::array<float, 3> origin{};  ///< local coordinates of Visibility, already off the surface
  Vec3 geometric_normal;          ///< rays below its horizon are blocked by the surface itself
  Vec3 normal;                    ///< the smooth one, for cosines
  bool glossy = false;            ///< whether the lobe is wanted
  Vec3 mirror;                    ///< unit mirror direction of the view
  double exponent = 0;            ///< Phong exponent of the lobe
};

/// Counts of rays; add up over points.
struct RayCounts {
  std::int64_t primary = 0;  ///< from the camera
  std::int64_t shadow = 0;   ///< traced towards the light
  std::int64_t points = 0;   ///< shading points
  RayCounts& operator+=(const RayCounts& o) {
    primary += o.primary, shadow += o.shadow, points += o.points;
    return *this;
  }
};

/// Working memory of one thread, reused from point to point.
struct PointScratch {
  std::vector<std::uint64_t> known, visible, refine;  // a bit a texel
  std::vector<float> lobe_weights;
};

/// Gathers light at points of one scene. Immutable, shared by all threads.
class PointTracer {
 public:
  /// `adaptive`: one ray a texel, and the table's other samples only where the texel crosses a
  /// horizon or its visibility differs from one of its four neighbours'. Otherwise all of them.
  /// Keeps references to both.
  PointTracer(const Visibility& visibility, const DirectionTable& table, bool adaptive);

  /// lambert[k] = integral over texel k of V max(0, n.w) / pi dw, and, if the point is glossy,
  /// lobe[k] = integral of V (e + 2) / (2 pi) max(0, cos alpha)^e max(0, n.w) dw; both of
  /// table.texels() entries. V is 0 below the geometric horizon.
  void trace(const ShadingPoint& point, std::span<float> lambert, std::span<float> lobe,
             PointScratch& scratch, RayCounts& counts) const;

  const DirectionTable& table() const { return table_; }

 private:
  void first_pass(const ShadingPoint& point, PointScratch& scratch, RayCounts& counts) const;
  void mark_differences(PointScratch& scratch) const;
  void refine(const ShadingPoint& point, const PhongLobe* phong, std::span<float> lambert,
              std::span<float> lobe, PointScratch& scratch, RayCounts& counts) const;

  const Visibility& visibility_;
  const DirectionTable& table_;
  bool adaptive_;
  // A bit a texel: it has a neighbour in its own face to the right, or below.
  std::vector<std::uint64_t> has_right_, has_below_;
};

}  // namespace haarlight
