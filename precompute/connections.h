// The receivers of a tile seen from a place on another surface, and how they would have found it.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/chances.h"
#include "precompute/lobe_lanes.h"
#include "precompute/point_tracer.h"
#include "precompute/receiver.h"
#include "precompute/surface.h"
#include "precompute/visibility.h"
#include "prt/transport.h"

namespace haarlight {

/// Whether paths that start by the cosine serve the lobe of `b`, too: one wide enough (half width
/// from 0.3).
bool shares_lobe(const Bsdf& b);

/// Directions so near each other (radians) that a wide lobe is the same for both.
inline constexpr double kNearlySame = 0.1;

/// A tile's receivers, and what they make of light from one place y at a time, with the balance
/// heuristic's weight
///     c(x) = f(x <- y) G(x, y) V(x, y) / sum over receivers x' of q(x') p(x' -> y),
/// p = cosine / pi and G the density with which x' would have found y, q the chance that x' was
/// asked. Reused from tile to tile.
class Connections {
 public:
  /// Rows of a weight: channel * kTileRows + row.
  static constexpr std::size_t kOut = 3 * kTileRows;

  /// Keeps a reference to `tile`.
  void begin(const TileReceivers& tile);
  /// Chances of receivers to start a path by the cosine, by their diffuse parts and wide lobes.
  const Chances& chances() const { return chances_; }

  /// Looks back from `y`, whose BSDF is `b` and which receiver `finder` has found.
  void look(const Visibility& visibility, const SurfaceHit& y, const Bsdf& b, std::size_t finder,
            RayCounts& counts);
  /// Adds the rows' weights for what y sends by diffuse reflection.
  void add_diffuse(const Bsdf& b, float* weights);
  /// Adds those for what y sends by a wide lobe to receivers that it sees within kNearlySame of the
  /// finder: they get what it would get. Whoever is that near to a receiver may serve it, so
  /// densities are summed over those. Requires sees(finder).
  void add_lobe(std::size_t finder, float* weights);
  /// Whether y sees a receiver.
  bool sees(std::size_t receiver) const { return geometry_[receiver] > 0 && density_ > 0; }

 private:
  void find_onwards();

  const TileReceivers* tile_ = nullptr;
  std::size_t count_ = 0, padded_ = 0;  // receivers; up to whole packets
  Chances chances_;

  // Of receivers, padded with ones that face nowhere.
  struct Lanes {
    std::vector<float> x, y, z;     // just off the surface
    std::vector<float> nx, ny, nz;  // shading normal
    std::vector<float> gx, gy, gz;  // geometric normal
    std::vector<float> chance;
    std::vector<float> diffuse[3], first[3], second[3];  // colours of the parts, times weight
  } of_;
  std::vector<std::int32_t> coat_;
  std::vector<std::size_t> row_;
  std::vector<std::size_t> terms_;  // receivers that stand for a term of a BRDF
  CoatTables coats_;
  LobeLanes lobes_;

  // Of one place: from it to the receivers.
  std::vector<float> dx_, dy_, dz_;       // whole way
  std::vector<float> wx_, wy_, wz_;       // unit, from receiver to place
  std::vector<float> cosine_, geometry_;  // at the receiver; 0: not seen
  std::vector<float> pass_, lobe_first_, lobe_second_, share_;
  std::vector<float> onwards_[3];  // what the row shows of light from y, over cosine / pi
  CoatTables place_coats_;
  double density_ = 0;
};

}  // namespace haarlight
