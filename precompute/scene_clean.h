// Mending a scene as files bring it: broken triangles out, normals in, vertices welded.

#pragma once

#include "precompute/scene.h"

namespace haarlight {

/// Makes `scene` fit for ray tracing, in place, and adds what it did to scene.report:
/// - triangles with a corner that is not finite or beyond 1e37, without area (twice the area below
/// 1e-12 of the
///   longest edge squared) or on the same three places as an earlier one are dropped;
/// - normals that are zero, not finite or missing (`normal` empty) are made: the mean of the faces
///   around the place, weighted by their angle there, leaving out those that meet this face at more
///   than 60 degrees (a crease). Faces wound the other way count with their normal reversed, and
///   the side is that of the most of them;
/// - vertices equal in everything become one, those that no triangle uses disappear.
/// `uv` may be empty. Throws Error{format} if a triangle names a vertex or material that is not
/// there, Error{missing} if no triangle is left.
void clean_scene(Scene& scene);

}  // namespace haarlight
