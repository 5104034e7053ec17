// Light that reaches a tile's receivers by way of other surfaces.
//
// Paths go backwards. From a receiver x a direction is drawn by the cosine (or by its lobe); where
// it meets a surface y, y looks for light from all directions by itself, as every later vertex of
// the path does: a path is a handful of vertices that each hand a whole row of the sky on, not one
// direction. What y sends to x by diffuse reflection it also sends to every other receiver of the
// tile that sees it, weighted by the balance heuristic
//     c(x) = f(x <- y) G(x, y) V(x, y) / (N sum over receivers x' of q(x') p(x' -> y)),
// p the density with which x' would have found y, q the chance that x' was asked: unbiased, and
// each receiver profits from the paths of all (Veach 1997, section 9.2; Bekaert and others 2002 for
// the sharing). Wide lobes (half
// width above 0.3) of receivers are served with their diffuse part; wide lobes of y serve receivers
// in nearly the finder's direction (0.1), as if it were the same. Narrow lobes and single
// directions serve the receiver they started from only.
//
// Light that has been reflected depends on its first direction more smoothly than direct light: it
// is a mean over all the places where it may have met the scene. So vertices look at the sky in
// squares of texels, and where those are still many, into a part of them each
// (precompute/sparse_directions.h). A tile's sum over paths is then one small matrix product: rows
// x paths times paths x squares.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "precompute/direction_table.h"
#include "precompute/effects.h"
#include "precompute/indirect_sky.h"
#include "precompute/point_tracer.h"
#include "precompute/receiver.h"
#include "precompute/scene.h"
#include "precompute/tile_noise.h"
#include "precompute/visibility.h"

namespace haarlight {

/// How long to go on.
struct PathBudget {
  double noise = 0.01;  ///< stop when the tile's worst() is at or below
  int most = 4096;      ///< or after so many paths of each kind; rounded up to kPathBatch
};

inline constexpr int kPathBatch = 512;

class Interreflection {
 public:
  /// `resolution`: squares along an edge of a cube face, a power of two, at most table.n. Keeps
  /// references to scene and visibility.
  Interreflection(const Scene& scene, const Visibility& visibility, const DirectionTable& table,
                  const Effects& effects, int resolution, std::uint64_t seed);
  ~Interreflection();

  struct Scratch;
  static std::unique_ptr<Scratch, void (*)(Scratch*)> make_scratch();

  /// One tile after the other, each in this order:
  ///   begin
  ///   add_direct   for every row and channel: all texels of what reaches it directly, against
  ///                which noise is measured; rows left out show nothing
  ///   trace        what reaches the receivers after 1 to effects.bounces bounces
  ///   add_to       for every row and channel: adds that to all of its texels
  /// All numbers depend on the receivers, their rows and the seed alone.
  void begin(Scratch& scratch) const;
  void add_direct(std::size_t row, std::size_t channel, const float* texels,
                  Scratch& scratch) const;
  void trace(const TileReceivers& tile, const PathBudget& budget, Scratch& scratch,
             TileNoise& noise, RayCounts& counts) const;
  void add_to(std::size_t row, std::size_t channel, float* texels, const Scratch& scratch) const;

 private:
  class Paths;

  const Scene& scene_;
  const Visibility& visibility_;
  Effects effects_;
  std::uint64_t seed_;
  IndirectSky sky_;
  double narrow_;  // lobes below this half width are sampled, radians
};

}  // namespace haarlight
