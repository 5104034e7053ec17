// Which effects a scene calls for, why, and what each costs: a look at the scene, not a run.

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "precompute/effects.h"
#include "precompute/scene.h"
#include "precompute/tile_source.h"
#include "precompute/tile_tracer.h"
#include "precompute/vertex_terms.h"
#include "precompute/visibility.h"

namespace haarlight {

/// One effect, judged.
struct EffectEstimate {
  std::string effect;
  bool needed = false;
  std::string why;     ///< one clause with the number that decided
  double error = 0;    ///< of the picture if it is left out: RMS over the built-in lightings of the
                       ///< relative RMS difference from the picture with everything
  double seconds = 0;  ///< of a whole run, that it costs; below 0: it saves
  double bytes = 0;    ///< of the file, likewise
};

/// What to simulate.
struct Plan {
  Effects effects;                   ///< all that are needed, none that are not
  std::vector<EffectEstimate> rows;  ///< shadows, self-occlusion, interreflection, color, gloss,
                                     ///< specular, caustics, view dependence
  double error = 0;                  ///< of leaving out what `effects` leaves out, all together
  double seconds = 0, bytes = 0;     ///< a run with `effects` on this machine, now
  double all_seconds = 0, all_bytes = 0;  ///< a run with everything
  double look_seconds = 0;  ///< what the look took, without costs: --effects auto takes it first
  std::vector<std::string> notes{};  ///< see precompute/scene_notes.h; by plan_image() and
                                     ///< plan_mesh()
  std::int64_t rays = 0;             ///< that the look took, pilots of cost not counted
  std::int64_t pilot_rays = 0;       ///< those
};

struct PlanOptions {
  TraceOptions trace;        ///< of the run that is planned; its effects do not matter
  double error = 0.01;       ///< half of it may be spent on leaving effects out
  bool costs = true;         ///< estimate seconds and bytes too, by tracing a few tiles in full
  bool vertices = false;     ///< rows are vertices: the view is not fixed
  TermOptions terms;         ///< of their BRDFs
  int terms_per_vertex = 1;  ///< rows a vertex has, set by plan_mesh()
};

/// The tiles of a run with the given options, made as often as needed.
using SourceMaker = std::function<std::unique_ptr<TileSource>(const TraceOptions&)>;

/// Looks at the scene's geometry and materials, and at 256 rows spread over `order` (row order of
/// the run) in faces of 16x16 texels, with each effect that the materials allow and without. An
/// effect is left out if all that are together cost at most half of options.error, the cheapest
/// first. A single convex body is planned without a ray. The same plan every time, costs apart.
/// Throws as TileTracer does.
Plan make_plan(const Scene& scene, const SourceMaker& source, std::span<const std::uint32_t> order,
               const PlanOptions& options);

/// The plan as a JSON object. `costs`: with seconds and bytes, which differ from run to run.
std::string to_json(const Plan& plan, bool costs);

}  // namespace haarlight
