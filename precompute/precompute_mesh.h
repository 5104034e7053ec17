// The offline main path for meshes: a scene in, a transport of its vertices out.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/camera.h"
#include "core/progress.h"
#include "precompute/precompute.h"
#include "precompute/scene.h"
#include "precompute/subdivide.h"
#include "precompute/vertex_terms.h"
#include "prt/transport_mesh.h"

namespace haarlight {

/// How a transport per vertex is made.
struct MeshOptions : PrecomputeOptions {
  bool subdivide = true;       ///< where visibility changes; see precompute/subdivide.h.
                               ///< The tolerance there is `error`, at least 0.005
  int max_vertices = 100'000;  ///< that subdivision may lead to
  TermOptions terms;           ///< of BRDFs, with effect gloss; without, diffuse parts alone
};

/// What making one did beside the report of all runs.
struct MeshReport {
  PrecomputeReport run;
  SubdivideReport subdivision;  ///< sizes of the mesh, subdivided or not
  double subdivision_seconds = 0;
  std::int64_t view_dependent = 0;  ///< vertices with a lobe, a mirror or glass
  int terms = 1;                    ///< of a vertex' BRDF, at most
  double terms_error = 0;           ///< what they leave of the BRDF that they fit worst
  std::string terms_material;       ///< the name of that one's material
};

/// Traces the light of every vertex of `scene`, subdivided where visibility changes, and writes
/// `file`: pilots, thresholds and resuming as precompute_image() does them. `camera` is the view
/// the mesh is first shown from. With effect gloss the
/// BRDFs of vertices are factored into terms and seen from anywhere (see VertexTerms); without it,
/// materials keep their diffuse part. Glass stays black. Throws as
/// precompute_image() does.
MeshReport precompute_mesh(const Scene& scene, const Camera& camera, const MeshOptions& options,
                           const std::filesystem::path& file, const Progress& progress = {});

/// What the rows depend on; see precompute_fingerprint().
std::string mesh_fingerprint(const Scene& scene, const Camera& camera, const MeshOptions& options);

/// The vertices and triangles of a scene as a transport keeps them, from the middle of their
/// bounding box, with a material a vertex.
TransportMesh transport_mesh(const Scene& scene);

}  // namespace haarlight
