// Plans for a scene: of a fixed view, or of its vertices.

#pragma once

#include "core/camera.h"
#include "precompute/plan.h"

namespace haarlight {

/// make_plan() for what precompute_image() would do. Throws as it does.
Plan plan_image(const Scene& scene, const Camera& camera, const PlanOptions& options);

/// make_plan() for what precompute_mesh() would do, on the mesh as it is, not subdivided.
Plan plan_mesh(const Scene& scene, const PlanOptions& options);

}  // namespace haarlight
