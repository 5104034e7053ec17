// A closed body from a function of space: surface nets.

#pragma once

#include <functional>

#include "core/vec.h"
#include "precompute/scene.h"

namespace haarlight::data_gen {

/// The surface where `inside` is 0, negative within, as triangles of one nameless material, normals
/// outwards along its gradient. One vertex a cell of `cells` along the longest side of the box from
/// `low` to `high`, where the mean of its edges' crossings is (Gibson 1998), moved onto the
/// surface. Closed if the function is positive all over the box's faces.
Scene isosurface(const std::function<double(const Vec3&)>& inside, const Vec3& low,
                 const Vec3& high, int cells);

/// The union of two bodies by their functions, joined by a fillet of about size k (Quilez,
/// polynomial smooth minimum).
double smooth_union(double a, double b, double k);

/// Distances to simple bodies, negative within. That to an ellipsoid is right at its surface only.
double sphere_distance(const Vec3& p, const Vec3& center, double radius);
double ellipsoid_distance(const Vec3& p, const Vec3& center, const Vec3& radii);
/// A rod from a to b whose radius goes from ra to rb.
double rod_distance(const Vec3& p, const Vec3& a, const Vec3& b, double ra, double rb);

}  // namespace haarlight::data_gen
