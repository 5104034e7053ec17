// haarlight precompute: traces a scene's transport for one view and writes it to a file.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/mpi_distribution.h"
#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/repairs.h"
#include "apps/run_options.h"
#include "apps/scene_options.h"
#include "apps/verbs.h"
#include "core/error.h"
#include "precompute/distribution.h"
#include "precompute/plan_scene.h"
#include "precompute/precompute_mesh.h"

namespace haarlight {
namespace {

struct PrecomputeCommand {
  SceneOptions scene;
  std::filesystem::path output;
  MeshOptions options;

  void run();

 private:
  void run_alone_or_together(Distribution* others);
  void choose_effects(const StagedScene& staged, bool speaks);
  void print_mesh(const MeshReport& report) const;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Only the leader of several processes speaks.
void PrecomputeCommand::run() {
  const std::unique_ptr<Distribution> others = start_distribution();
  if (!others || others->leads()) {
    run_alone_or_together(others.get());
    return;
  }
  try {
    run_alone_or_together(others.get());
  } catch (const std::exception&) {
    throw SilentFailure();
  }
}

void PrecomputeCommand::run_alone_or_together(Distribution* others) {
  const auto begin = std::chrono::steady_clock::now();
  const bool speaks = !others || others->leads();
  StagedScene staged;
  together(others, [&] {
    // Long work must not end at a place that cannot be written.
    if (speaks) require_writable_file(output);
    staged = load_scene(scene, speaks);
    choose_effects(staged, speaks);
  });
  const Scene& imported = staged.scene;
  const Stage& made = staged.stage;
  options.distribution = others;
  options.scene_file = scene.scene;
  PrecomputeReport report;
  std::optional<MeshReport> mesh;
  {
    ProgressPrinter progress("precompute");
    const Progress show = [&](double share) { return !speaks || progress(share); };
    MeshOptions watched = options;
    if (speaks) static_cast<RunOptions&>(watched) = watched_by(progress, options);
    if (watched.time_limit > 0) {  // importing counts
      watched.time_limit = std::max(0.05, watched.time_limit - seconds_since(begin));
    }
    if (scene.vertices) {
      mesh = precompute_mesh(imported, made.camera, watched, output, show);
      report = mesh->run;
    } else {
      report = precompute_image(imported, made.camera, watched, output, show);
    }
  }
  if (!speaks) return;
  fmt::print("{}: {}x{} pixels, {}{}\n", output.string(), scene.stage.width, scene.stage.height,
             made.camera_made ? "framing camera" : "camera of the scene",
             made.ground_added ? ", ground added" : "");
  if (mesh) print_mesh(*mesh);
  print_notes(scene.scene, report.notes);
  print_outcome(output, options, report);
}

// By the plan unless the user has said; every process finds the same one.
void PrecomputeCommand::choose_effects(const StagedScene& staged, bool speaks) {
  if (scene.auto_effects) {
    PlanOptions planning;
    planning.trace = options.trace;
    planning.error = options.error;
    planning.costs = false;
    planning.terms = options.terms;
    const Plan plan = scene.vertices ? plan_mesh(staged.scene, planning)
                                     : plan_image(staged.scene, staged.stage.camera, planning);
    options.trace.effects = plan.effects;
    options.plan = to_json(plan, false);
    if (speaks) {
      fmt::print("effects: {}", to_string(plan.effects));
      if (plan.error > 0) fmt::print(" (what is left out: {:.2g} of the picture)", plan.error);
      fmt::print("\n");
      std::fflush(stdout);
    }
  }
  if (scene.bounces >= 0) options.trace.effects.bounces = scene.bounces;
}

void PrecomputeCommand::print_mesh(const MeshReport& report) const {
  const SubdivideReport& s = report.subdivision;
  fmt::print("{} vertices, {} triangles", s.vertices, s.triangles);
  if (s.split_edges > 0) {
    fmt::print(", {} edges split in {:.1f} s where the light changes", s.split_edges,
               report.subdivision_seconds);
  }
  fmt::print("\n");
  if (report.view_dependent == 0) return;
  if (report.terms > 1) {
    fmt::print(
        "{} terms a vertex; what they leave is largest of material \"{}\": {:.2g} of its "
        "BRDF\n",
        report.terms, report.terms_material, report.terms_error);
  } else if (!options.trace.effects.gloss) {
    fmt::print("{} vertices are glossy, mirrors or glass: their diffuse part alone is kept\n",
               report.view_dependent);
  }
}

}  // namespace

Verb add_precompute(CLI::App& verb) {
  auto command = std::make_shared<PrecomputeCommand>();
  PrecomputeCommand& c = *command;

  add_path(verb, "-o,--output", c.output, "FILE.hlt", "transport file to write")->required();

  add_scene_options(verb, c.scene, c.options);
  add_run_options(verb, c.options);

  verb.footer(
      "\nA mesh without material, camera or ground gets grey diffuse, a framing camera and a "
      "plane.\n"
      "Until the file is complete the part done is in FILE.hlt.partial. Ctrl-C (or --time-limit)\n"
      "leaves that and a file whose missing parts are a preview; a second Ctrl-C ends at once.\n\n"
      "Examples:\n"
      "  haarlight precompute bunny.obj -o bunny.hlt\n"
      "  haarlight precompute bunny.obj -o mesh.hlt --vertices --face 32\n"
      "  haarlight precompute street.glb -o street.hlt --vertices --terms 4\n"
      "  haarlight precompute room.glb -o room.hlt --size 1280x720 --error 0.005\n"
      "  haarlight precompute room.glb -o room.hlt --size 1280x720 --error 0.005 --resume\n"
      "  haarlight precompute room.glb -o room.hlt --time-limit 600 --max-bytes 200M");
  return [command] { command->run(); };
}

}  // namespace haarlight
