// haarlight plan: which effects a scene calls for, and what each costs.

#include "precompute/plan.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "apps/option_parsers.h"
#include "apps/repairs.h"
#include "apps/scene_options.h"
#include "apps/verbs.h"
#include "caching/motion_plan.h"
#include "core/error.h"
#include "precompute/plan_scene.h"

namespace haarlight {
namespace {

std::string seconds_text(double seconds) {
  if (std::abs(seconds) < 0.05) return "0 s";
  if (std::abs(seconds) < 120) return fmt::format("{:.1f} s", seconds);
  return fmt::format("{:.0f} min", seconds / 60);
}

std::string bytes_text(double bytes) {
  const double mib = bytes / (1024.0 * 1024.0);
  return std::abs(mib) < 0.05 ? "0 MiB"
                              : fmt::format("{:.{}f} MiB", mib, std::abs(mib) < 10 ? 1 : 0);
}

std::string error_text(double error) {
  if (error == 0) return "0";
  return error < 1e-4 ? "< 0.01 %" : fmt::format("{:.{}f} %", 100 * error, error < 0.1 ? 2 : 0);
}

// What of a glTF file moves; nothing of files that hold no animation that can be read, which is for
// animate to complain about.
std::optional<MotionPlan> motion_of(const std::filesystem::path& file, bool interactive) {
  if (file.extension() != ".gltf" && file.extension() != ".glb") return std::nullopt;
  try {
    const AnimatedScene scene(file);
    return interactive ? plan_interaction(scene) : plan_motion(scene);
  } catch (const Error&) {
    return std::nullopt;
  }
}

struct PlanCommand {
  SceneOptions scene;
  MeshOptions options;
  bool json = false, interactive = false;

  void run();
};

void PlanCommand::run() {
  const StagedScene staged = load_scene(scene);
  PlanOptions planning;
  planning.trace = options.trace;
  planning.error = options.error;
  planning.terms = options.terms;
  const Plan plan = scene.vertices ? plan_mesh(staged.scene, planning)
                                   : plan_image(staged.scene, staged.stage.camera, planning);
  print_notes(scene.scene, plan.notes);
  const std::optional<MotionPlan> motion = motion_of(scene.scene, interactive);
  if (json) {
    nlohmann::json out = nlohmann::json::parse(to_json(plan, true));
    if (motion) {
      out["method"] = {
          {"name", to_string(motion->method)},  {"why", motion->why},
          {"moving_triangles", motion->moving}, {"moving_lights", motion->moving_lights},
          {"near_lights", motion->near_lights}, {"frames", motion->frames},
          {"touched_rays", motion->touched}};
    }
    fmt::print("{}\n", out.dump());
    return;
  }
  fmt::print("{:<16} {:<7} {:>13} {:>9} {:>10}  {}\n", "effect", "needed", "error without", "time",
             "bytes", "why");
  for (const EffectEstimate& r : plan.rows) {
    fmt::print("{:<16} {:<7} {:>13} {:>9} {:>10}  {}\n", r.effect, r.needed ? "yes" : "no",
               error_text(r.error), seconds_text(r.seconds), bytes_text(r.bytes), r.why);
  }
  fmt::print("\n--effects {}\n", to_string(plan.effects));
  fmt::print("this plan: {}, {}, {} of the picture left out; everything: {}, {}\n",
             seconds_text(plan.seconds), bytes_text(plan.bytes), error_text(plan.error),
             seconds_text(plan.all_seconds), bytes_text(plan.all_bytes));
  fmt::print(
      "by {} rays of low resolution in {}, which --effects auto takes first; and {} for the "
      "costs\n",
      plan.rays, seconds_text(plan.look_seconds), plan.pilot_rays);
  if (motion) fmt::print("method {}: {}\n", to_string(motion->method), motion->why);
}

}  // namespace

Verb add_plan(CLI::App& verb) {
  auto command = std::make_shared<PlanCommand>();
  PlanCommand& c = *command;
  add_scene_options(verb, c.scene, c.options);
  verb.add_flag("--json", c.json, "the same for programs");
  verb.add_flag(
      "--interactive", c.interactive,
      "glTF: a person will move things, and no frame is known beforehand: which method then");
  add_threads(verb)->group("Running");
  verb.footer(
      "\nThe error without an effect is relative RMS over the picture and the built-in lightings;\n"
      "time and bytes are what it adds to a whole run on this machine.\n\n"
      "Examples:\n"
      "  haarlight plan room.glb\n"
      "  haarlight plan room.glb --size 1280x720 --error 0.02 --json");
  return [command] { command->run(); };
}

}  // namespace haarlight
