// The nearest triangle along a ray: a plain tree of boxes, in double, for references only.

#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "precompute/scene.h"

namespace haarlight::reference {

/// Triangles of a scene in a tree of boxes cut at the median. Triangles are met from both sides;
/// borders belong to them, so that no ray slips between neighbours.
class TriangleTree {
 public:
  /// Throws Error{missing} for a scene without triangles. Keeps a copy of the corners.
  explicit TriangleTree(const Scene& scene);

  struct Hit {
    std::uint32_t triangle = 0;
    double b1 = 0, b2 = 0;  ///< barycentric coordinates of the second and third corner
    double distance = 0;    ///< metres, for a unit direction
  };
  /// The nearest triangle at a distance in (nearer, farther), or with `any` whichever is found
  /// first. Source: Moeller and Trumbore 1997.
  std::optional<Hit> hit(const Vec3& origin, const Vec3& direction, bool any = false,
                         double nearer = 0,
                         double farther = std::numeric_limits<double>::infinity()) const;

  /// Largest side of the box of all triangles, metres.
  double extent() const { return extent_; }

 private:
  struct Corners {
    Vec3 a, e1, e2;
    std::uint32_t triangle = 0;
  };
  struct Node {
    Vec3 low, high;
    std::uint32_t first = 0;  // of its triangles, or its second child (the first one follows it)
    std::uint32_t count = 0;  // of its triangles; 0: inner
  };
  void build(std::size_t begin, std::size_t end);

  std::vector<Corners> corners_;
  std::vector<Node> nodes_;
  double extent_ = 0;
};

}  // namespace haarlight::reference
