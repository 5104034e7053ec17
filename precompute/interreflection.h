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

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "precompute/effects.h"
#include "precompute/point_tracer.h"
#include "precompute/receiver.h"
#include "precompute/scene.h"
#include "precompute/sparse_directions.h"
#include "precompute/visibility.h"
#include "wavelet/haar.h"

namespace haarlight {

/// How noisy a tile's picture is under the built-in lightings; add up over tiles.
struct TileNoise {
  std::vector<double> variance;  ///< per lighting: of the picture, summed over rows and channels
  std::vector<double> energy;    ///< per lighting: the picture squared, summed likewise
  std::int64_t paths = 0;        ///< traced
  void add(const TileNoise& other);
  /// The largest relative noise, root of variance by energy, over the lightings; 0 without any.
  double worst() const;
};

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

  /// Adds to `rows`, [channel][row][texel] with kTileRows rows of all texels, what reaches the
  /// receivers after 1 to effects.bounces bounces. `rows` holds what reaches them directly, against
  /// which noise is measured. All numbers depend on the receivers and the seed alone.
  void add(const TileReceivers& tile, const PathBudget& budget, Scratch& scratch,
           std::span<float> rows, TileNoise& noise, RayCounts& counts) const;

 private:
  class Batch;

  std::size_t phases() const { return static_cast<std::size_t>(directions_.phases()); }

  const Scene& scene_;
  const Visibility& visibility_;
  Effects effects_;
  std::uint64_t seed_;
  HaarLayout layout_;
  SparseDirections directions_;
  double narrow_;                      // lobes below this half width are sampled, radians
  std::vector<std::uint32_t> sum_at_;  // per texel: where its square's sum is for row 0
  std::size_t lights_ = 0;
  std::vector<float> light_;         // [phase][light][slot]
  std::vector<float> light_texels_;  // [light][texel]
};

}  // namespace haarlight
