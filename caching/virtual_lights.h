// Virtual point lights: where paths from the lights meet surfaces (instant radiosity).

#pragma once

#include <cstdint>
#include <vector>

#include "caching/moving_visibility.h"
#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// A light without size that sends from a diffuse surface, or from infinitely far away. A plain
/// value: its bits tell whether it has changed.
struct VirtualLight {
  enum class Kind : std::uint32_t {
    none,     ///< its path met nothing: it lights nothing
    surface,  ///< sends intensity * cosine about `normal`
    distant   ///< a direction of the background
  };
  Kind kind = Kind::none;
  Vec3 position;          ///< local units of MovingVisibility; distant: the unit direction to it
  Vec3 geometric_normal;  ///< unit, on the lit side
  Vec3 normal;            ///< unit, interpolated
  /// surface: W/sr along the normal, times the square of MovingVisibility::scale(), so that over
  /// the square of a local distance it is irradiance (L_e of equation 1, integrated); distant:
  /// irradiance across its direction, W/m^2.
  RgbD intensity;

  bool operator==(const VirtualLight&) const = default;
  /// All but the intensity: whether the same rays lead to it.
  bool same_place(const VirtualLight& o) const {
    return kind == o.kind && position == o.position && geometric_normal == o.geometric_normal &&
           normal == o.normal;
  }
};

struct VirtualLightOptions {
  int count = 256;  ///< >= 1: numbers, whether or not all light something
  int bounces = 6;  ///< at most so many reflections before the last one, >= 1
  std::uint64_t seed = 1;
};

/// The lights of a frame by number. Every lamp, every material that shines, all small suns of the
/// background and what is left of it have the same share of the numbers, and the directions of that
/// another. A path of number i takes its directions from point i of one
/// scrambled Halton sequence (Keller 1997; Debattista and others 2009, section 3.2), in each frame
/// the same, so that where nothing moves light i is the same bits. A fixed part of the paths goes
/// on: as many as half of those before, each weighted for those that do not; no albedo decides it,
/// so numbers never shift. Mirrors and glass are passed, narrow lobes swallow what they would
/// reflect. The same bits on any number of threads.
std::vector<VirtualLight> virtual_lights(const MovingVisibility& scene,
                                         const VirtualLightOptions& options);

/// Places on shining materials that light surfaces directly: `points` for each material, the same
/// ones in each frame. Each sends as a one-sided `surface` light with shining area's intensity;
/// where the material shines from both sides there is one for each side.
std::vector<VirtualLight> shining_places(const MovingVisibility& scene, int points);

/// Irradiance at a place (local) with this normal, without occlusion: bounded as in equations 2
/// and 3, nothing nearer than 0.8 `least_distance` (local units). `lost`: what the bound took away,
/// if asked for.
RgbD arrival(const VirtualLight& light, const Vec3& position, const Vec3& normal,
             double least_distance, RgbD* lost = nullptr);
/// Equation 3: 0 below a, 1 above b, smooth between. 1 from b on where a = b = 0.
double smooth_step(double a, double b, double x);

/// The ray that decides whether it arrives.
Segment segment_to(const VirtualLight& light, const Vec3& position, const Vec3& geometric_normal);

/// The normal of a hit without normal textures, on the side of its geometric normal.
Vec3 smooth_normal(const Scene& scene, const Visibility::Hit& hit, const Vec3& geometric_normal);

}  // namespace haarlight
