// Surfaces close to lamps, so bright that few paths by chance are not enough.

#pragma once

#include <cstdint>
#include <vector>

#include "caching/animated_scene.h"
#include "precompute/chances.h"
#include "precompute/visibility.h"

namespace haarlight {

/// Triangles that lamps light to more than 16 times the mean radiosity of the scene, as far as
/// centres of triangles say: the inside of a lamp's shade. Immutable.
class BrightSurfaces {
 public:
  BrightSurfaces(const AnimatedFrame& frame, const Visibility& visibility);

  bool empty() const { return bright_.empty(); }

  struct Sample {
    Visibility::Hit hit;  ///< without a distance
    Vec3 position;        ///< local
    double chance;        ///< density per local area, > 0
  };
  /// A place on them, triangles by the light they reflect. Three numbers in [0, 1); not if empty.
  Sample choose(double u, double v, double w) const;
  /// The density with which choose() finds a place of a triangle; 0 for those that are not bright.
  double chance(std::uint32_t triangle) const {
    return number_.empty() || number_[triangle] < 0 ? 0 : density(number_[triangle]);
  }

 private:
  double density(std::int32_t i) const {
    const auto n = static_cast<std::size_t>(i);
    return chances_.of(n) / bright_[n].area;
  }
  struct Bright {
    std::uint32_t triangle;
    double area;  ///< local units squared
  };
  const Visibility& visibility_;
  std::vector<Bright> bright_;
  Chances chances_;
  std::vector<std::int32_t> number_;  // in bright_ by triangle, or -1; empty: none is bright
};

}  // namespace haarlight
