// One shading point -> what each texel of distant light contributes to it. The hot loop.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/vec.h"
#include "precompute/direction_table.h"
#include "precompute/lobe_lanes.h"
#include "precompute/receiver.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

class GlossyLobe;

/// Where light is gathered. Both normals are unit and on the viewer's side.
struct ShadingPoint {
  std::array<float, 3> origin{};  ///< local coordinates of Visibility, already off the surface
  Vec3 geometric_normal;          ///< rays below its horizon are blocked by the surface itself
  Vec3 normal;                    ///< the smooth one, for cosines
  bool glossy = false;            ///< whether the lobe is wanted
  Bsdf bsdf;                      ///< its lobe and coat; what mirrors and glass nearby send
};

/// The shading point of a receiver; its lobe is wanted if it has one.
ShadingPoint shading_point(const Receiver& receiver);

/// What a single direction of light adds to one texel of a row.
struct Deposit {
  std::size_t texel = 0;
  RgbD value;
};

/// Counts of rays; add up over points.
struct RayCounts {
  std::int64_t primary = 0;     ///< from the camera
  std::int64_t shadow = 0;      ///< traced towards the light
  std::int64_t specular = 0;    ///< through mirrors and glass, from the camera or towards light
  std::int64_t bounce = 0;      ///< from surface to surface
  std::int64_t connection = 0;  ///< between a path and a receiver
  std::int64_t points = 0;      ///< shading points
  std::int64_t paths = 0;       ///< of interreflection
  std::int64_t rays() const { return primary + shadow + specular + bounce + connection; }
  RayCounts& operator+=(const RayCounts& o) {
    primary += o.primary, shadow += o.shadow, specular += o.specular, bounce += o.bounce;
    connection += o.connection, points += o.points, paths += o.paths;
    return *this;
  }
};

/// Working memory of one thread, reused from point to point.
struct PointScratch {
  std::vector<std::uint64_t> known, visible, refine;  // a bit a texel
  std::vector<float> first_weights, second_weights;
  std::vector<float> turns;   // cosines and sines of multiples of an angle
  std::vector<float> second;  // for callers that do not want it
  CoatTables coat;
  std::vector<float> pass;
};

/// Where the parts of a row go; each of table.texels() entries, replaced.
struct PointRow {
  std::span<float> diffuse;  ///< integral over a texel of V diffuse_in dw
  std::span<float> first;    ///< of V lobe_values().first dw; untouched unless glossy
  std::span<float> second;   ///< of V lobe_values().second dw; likewise
  std::vector<Deposit>* deposits = nullptr;  ///< appended to; none wanted if null
};

/// Gathers light at points of one scene. Immutable, shared by all threads.
class PointTracer {
 public:
  /// `adaptive`: one ray a texel, and the table's other samples only where the texel crosses a
  /// horizon or its visibility differs from one of its four neighbours'. Otherwise all of them.
  /// `shadows`: off, no rays are traced and V is 1 above the horizons. Keeps references to both.
  PointTracer(const Visibility& visibility, const DirectionTable& table, bool adaptive,
              bool shadows = true);

  /// All of a point's row but light through mirrors and glass. V is 0 below the geometric horizon.
  /// Deposits, already coloured by the BSDF, are what narrow lobes see (see GlossyLobe).
  void trace(const ShadingPoint& point, const PointRow& row, PointScratch& scratch,
             RayCounts& counts) const;

  /// The same for Lambert and Phong alone: no coat, no second factor, no deposits.
  void trace(const ShadingPoint& point, std::span<float> lambert, std::span<float> lobe,
             PointScratch& scratch, RayCounts& counts) const;

  /// The rows of several terms of a BRDF at once: per term, V_s f_k(w_s) dw_s summed over the
  /// samples of each texel. `rows` are one a term, table().texels() each, replaced. point.bsdf and
  /// its term do not matter.
  void trace_terms(const ShadingPoint& point, std::span<const IncomingTerm* const> terms,
                   std::span<const std::span<float>> rows, PointScratch& scratch,
                   RayCounts& counts) const;

  /// Appends the light that reaches the point, already coloured by its BSDF, by way of mirrors and
  /// glass and nothing else: every sample of a texel that one of them blocks is followed until it
  /// leaves the scene. Right after trace() of the same point with the same scratch.
  void trace_caustics(const Scene& scene, const ShadingPoint& point, PointScratch& scratch,
                      std::vector<Deposit>& deposits, RayCounts& counts) const;

  const DirectionTable& table() const { return table_; }

 private:
  void first_pass(const ShadingPoint& point, PointScratch& scratch, RayCounts& counts) const;
  void mark_differences(PointScratch& scratch) const;
  void refine(const ShadingPoint& point, const GlossyLobe* lobe, const PointRow& row,
              PointScratch& scratch, RayCounts& counts) const;
  void look(const ShadingPoint& point, PointScratch& scratch, RayCounts& counts) const;
  void draw_lobe(const ShadingPoint& point, std::vector<Deposit>& deposits,
                 RayCounts& counts) const;

  const Visibility& visibility_;
  const DirectionTable& table_;
  bool adaptive_, shadows_;
  // A bit a texel: it has a neighbour in its own face to the right, or below.
  std::vector<std::uint64_t> has_right_, has_below_;
};

}  // namespace haarlight
