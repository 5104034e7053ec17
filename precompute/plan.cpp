// Which effects a scene calls for, why, and what each costs.

#include "precompute/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/parallel.h"
#include "precompute/brdf_factors.h"
#include "precompute/bsdf.h"
#include "precompute/pilots.h"
#include "precompute/probe.h"
#include "precompute/scene_facts.h"
#include "precompute/scene_objects.h"
#include "prt/transport_writer.h"

namespace haarlight {
namespace {

constexpr double kShareForEffects = 0.5;  // of the error allowed; the rest is compression's
constexpr int kBounceSteps[] = {0, 1, 2, 3, 4, 6, 10, kMostBounces};

std::string percent(double share) {
  return fmt::format("{:.{}f} %", 100 * share, share < 0.1 ? 2 : 0);
}

// What a run costs, from a few tiles traced in full.
struct Cost {
  double seconds = 0, bytes = 0;
};

class CostMeter {
 public:
  CostMeter(const SourceMaker& source, std::span<const std::uint32_t> order,
            const PlanOptions& options)
      : source_(source), order_(order), options_(options) {
    TraceOptions direct = options.trace;
    direct.effects = Effects{false, 0, false, false, false, false};
    const auto maker = source(direct);
    const auto worker = maker->make_worker();
    const std::vector<int> all = tiles_with_scene(*worker, order);
    seen_ = static_cast<double>(all.size());
    const std::size_t count = std::min<std::size_t>(kCostTiles, all.size());
    for (std::size_t i = 0; i < count; ++i) {
      tiles_.push_back(all[(2 * i + 1) * all.size() / (2 * count)]);
    }
  }

  Cost of(const Effects& effects) {
    Cost cost;
    if (tiles_.empty()) return cost;
    TraceOptions trace = options_.trace;
    trace.effects = effects;
    const auto tiles = source_(trace);
    ToleranceTuner tuner(tiles->layout(), options_.error);
    std::vector<TileRows> rows(tiles_.size());
    std::vector<double> seconds(tiles_.size(), 0.0);
    std::vector<std::unique_ptr<TileSource::Worker>> workers;
    for (std::size_t i = 0; i < tiles_.size(); ++i) workers.push_back(nullptr);
    parallel_for(static_cast<int>(tiles_.size()), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      workers[at] = tiles->make_worker();
      const auto start = std::chrono::steady_clock::now();
      workers[at]->trace(
          order_.subspan(static_cast<std::size_t>(tiles_[at]) * kTileRows, kTileRows), rows[at]);
      seconds[at] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    });
    double spent = 0;
    for (std::size_t i = 0; i < tiles_.size(); ++i) {
      tuner.add(rows[i]);
      spent += seconds[i];
      rays_ += workers[i]->counts.rays();
    }
    const double each = spent / static_cast<double>(tiles_.size());
    // Compressing and writing take about a fifth of direct light's time.
    cost.seconds = 1.1 * each * (seen_ + std::min<double>(kPilotTiles, seen_)) / thread_count();
    const std::vector<float> thresholds =
        tuner.thresholds(static_cast<int>(seen_), std::min(kPilotTiles, static_cast<int>(seen_)));
    const float threshold =
        thresholds.empty() ? 0.0f : *std::max_element(thresholds.begin(), thresholds.end());
    cost.bytes = tuner.tile_bytes(threshold) * seen_;
    return cost;
  }

  std::int64_t rays() const { return rays_; }

 private:
  static constexpr std::size_t kCostTiles = 8;
  const SourceMaker& source_;
  std::span<const std::uint32_t> order_;
  const PlanOptions& options_;
  std::vector<int> tiles_;
  double seen_ = 0;
  std::int64_t rays_ = 0;
};

// One switch of Effects, and what the materials have to do with it.
struct Candidate {
  std::string effect;
  Effects with;     // everything, or for shadows direct light alone
  Effects without;  // the same but it
  double error = 0;
  std::size_t row = 0;  // of the plan
};

Effects less(const Effects& a, const Effects& b) {
  return {a.shadows && b.shadows,   std::min(a.bounces, b.bounces), a.gloss && b.gloss,
          a.specular && b.specular, a.caustics && b.caustics,       a.color && b.color};
}

}  // namespace

Plan make_plan(const Scene& scene, const SourceMaker& source, std::span<const std::uint32_t> order,
               const PlanOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Plan plan;
  const SceneFacts facts = scene_facts(scene);
  const SceneObjects objects = find_objects(scene);
  const auto convex =
      static_cast<int>(std::count(objects.convex.begin(), objects.convex.end(), true));
  const bool lone_convex = objects.count() == 1 && convex == 1 && !facts.has_glass;
  const double budget = kShareForEffects * options.error;

  // What the scene can have at all.
  Effects possible = all_effects();
  possible.shadows = !lone_convex;
  possible.bounces = lone_convex || !facts.reflects ? 0 : kMostBounces;
  // Seen from anywhere, mirrors are narrow lobes.
  const bool blurred = options.vertices && options.terms_per_vertex > 1;
  // Tables of BRDFs are shown by their terms, which belong to gloss; the probe sees their mean
  // alone.
  const bool tables = options.vertices && facts.measured_area > 0;
  possible.gloss = facts.glossy_area > 0 || blurred || tables;
  possible.specular = facts.specular_area > 0;
  possible.caustics = facts.specular_area > 0 && !lone_convex;
  possible.color = facts.colored;
  Effects chosen = possible;

  const auto add = [&](const std::string& effect, bool needed, const std::string& why,
                       double error) {
    plan.rows.push_back({effect, needed, why, error, 0, 0});
    return plan.rows.size() - 1;
  };

  std::vector<Candidate> candidates;
  const bool look = possible.shadows || possible.gloss || possible.specular || possible.color;
  std::optional<Probe> probe;
  std::optional<Pictures> whole;
  std::vector<double> bounce_errors;  // of kBounceSteps
  if (look) {
    probe.emplace(source, order, options.trace);
    whole = probe->pictures(possible);
  }
  const auto error_of = [&](const Effects& effects) {
    return whole->error(probe->pictures(effects));
  };

  // Shadows, and what an object does to itself.
  if (lone_convex) {
    add("shadows", false, "the scene is one convex body", 0);
  } else {
    Effects direct = possible;
    direct.bounces = 0;
    direct.caustics = false;
    Effects open = direct;
    open.shadows = false;
    const Pictures shadowed = probe->pictures(direct), unshadowed = probe->pictures(open);
    const double blocked = 1 - shadowed.even_light() / unshadowed.even_light();
    const double error = whole->energy_error(shadowed, unshadowed);
    candidates.push_back({"shadows", direct, open, error, 0});
    candidates.back().row = add(
        "shadows", true, fmt::format("{} of the sky's light is blocked", percent(blocked)), error);
  }
  add("self-occlusion", !lone_convex && convex < objects.count(),
      fmt::format("{} of {} objects {} convex and cannot shadow {}", convex, objects.count(),
                  convex == 1 ? "is" : "are", convex == 1 ? "itself" : "themselves"),
      plan.rows.front().error);

  // Interreflection, by bounces.
  if (possible.bounces == 0) {
    add("interreflection", false,
        lone_convex ? "a convex body does not light itself"
                    : fmt::format("mean albedo {:.2g}: nothing to reflect", facts.mean_albedo),
        0);
  } else {
    std::vector<double> light;
    for (const int n : kBounceSteps) {
      Effects e = possible;
      e.bounces = n;
      const Pictures p = n == kMostBounces ? *whole : probe->pictures(e);
      bounce_errors.push_back(whole->error(p));
      light.push_back(p.even_light());
    }
    // The fewest that the budget has room for beside other things.
    std::size_t enough = 0;
    while (bounce_errors[enough] > 0.5 * budget) ++enough;
    chosen.bounces = kBounceSteps[enough];
    // Roulette makes far bounces nearly free; cutting them short saves time only if they are few.
    if (chosen.bounces > 4) chosen.bounces = kMostBounces;
    std::string series;
    for (std::size_t i = 1; i < std::size(kBounceSteps) && kBounceSteps[i] <= 3; ++i) {
      series +=
          fmt::format("{}{}", i > 1 ? ", " : "", percent((light[i] - light[i - 1]) / light.back()));
    }
    const std::size_t row =
        add("interreflection", chosen.bounces > 0,
            fmt::format("mean albedo {:.2g}; bounces bring {} of the light; {} needed",
                        facts.mean_albedo, series,
                        chosen.bounces == kMostBounces ? std::string("all are")
                        : chosen.bounces == 1          ? std::string("1 is")
                                                       : fmt::format("{} are", chosen.bounces)),
            bounce_errors.front());
    Effects without = possible;
    without.bounces = 0;
    candidates.push_back({"interreflection", possible, without, bounce_errors.front(), row});
  }

  const auto judge = [&](const std::string& effect, bool Effects::*member, bool can,
                         const std::string& why, const std::string& why_not) {
    if (!can) {
      add(effect, false, why_not, 0);
      return;
    }
    Effects without = possible;
    without.*member = false;
    const double error = error_of(without);
    candidates.push_back({effect, possible, without, error, add(effect, true, why, error)});
  };
  judge("color", &Effects::color, possible.color,
        "colours do not factor out of all rows: three channels there",
        "one colour factors out: one channel, a third of the bytes");
  const double brdf_error = std::max(options.error, 1e-3);
  const int terms =
      facts.glossiest < 0
          ? 0
          : brdf_terms(scene.material[static_cast<std::size_t>(facts.glossiest)], brdf_error);
  const auto worth = [](int k) {
    return k > kMostBrdfTerms ? fmt::format("more than K = {} terms", kMostBrdfTerms)
                              : fmt::format("K = {} terms", k);
  };
  if (tables) {
    const BrdfSpectrum table(scene.material[static_cast<std::size_t>(facts.measured)], false);
    // What one term leaves of a table, by its share of the surface, beside what lobes bring.
    const double left = facts.measured_area * table.error(1);
    Effects without = possible;
    without.gloss = false;
    const double lobes = facts.glossy_area > 0 ? error_of(without) : 0;
    add("gloss", true,
        fmt::format(
            "measured BRDFs are {} of the surface; seen from all sides the largest is worth "
            "{}{}",
            percent(facts.measured_area), worth(table.terms_for(brdf_error, kMostBrdfTerms)),
            facts.glossy_area > 0 ? fmt::format(", lobes are {} more", percent(facts.glossy_area))
                                  : std::string()),
        std::hypot(left, lobes));
  } else {
    judge("gloss", &Effects::gloss, possible.gloss,
          facts.glossy_area == 0
              ? fmt::format("{} of the surface are mirrors, blurred lobes at vertices",
                            percent(facts.specular_area))
              : fmt::format("{} of the surface; seen from all sides the narrowest lobe is worth {}",
                            percent(facts.glossy_area), worth(terms)),
          "no material has a lobe");
  }
  judge("specular", &Effects::specular, possible.specular,
        fmt::format("mirrors and glass are {} of the surface", percent(facts.specular_area)),
        "no mirrors, no glass");
  judge("caustics", &Effects::caustics, possible.caustics,
        fmt::format("mirrors and glass are {} of the surface", percent(facts.specular_area)),
        possible.specular ? "a convex body does not light itself" : "no mirrors, no glass");
  {
    double error = 0;
    for (const EffectEstimate& r : plan.rows) {
      if (r.effect == "gloss" || r.effect == "specular") error = std::max(error, r.error);
    }
    const double varying = facts.glossy_area + facts.specular_area + facts.measured_area;
    const bool varies = varying > 0;
    add("view dependence", options.vertices && varies,
        !varies ? "all materials are diffuse"
        : options.vertices
            ? fmt::format("{} of the surface looks different from each side: {} term{} a vertex",
                          percent(varying), options.terms_per_vertex,
                          options.terms_per_vertex == 1 ? "" : "s")
            : "the view is fixed: it is in the rows",
        options.vertices ? error : 0);
  }

  // Leave out what costs little, the cheapest first, and look at all that is left out together.
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
  std::size_t left_out = 0;
  double square = 0;
  for (const Candidate& c : candidates) {
    square += c.error * c.error;
    if (std::sqrt(square) > budget) break;
    ++left_out;
  }
  const auto effects_without = [&](std::size_t count) {
    Effects e = chosen;
    for (std::size_t i = 0; i < count; ++i) e = less(e, candidates[i].without);
    return e;
  };
  if (look) {
    plan.effects = effects_without(left_out);
    plan.error = error_of(plan.effects);
    while (plan.error > budget && left_out > 0) {
      --left_out;
      plan.effects = effects_without(left_out);
      plan.error = error_of(plan.effects);
    }
    if (plan.error > budget) {  // bounces cut short are the only thing left
      plan.effects.bounces = kMostBounces;
      plan.error = error_of(plan.effects);
    }
  } else {
    plan.effects = chosen;
  }
  for (EffectEstimate& row : plan.rows) {
    if (row.effect == "shadows") row.needed = plan.effects.shadows;
    if (row.effect == "interreflection") row.needed = plan.effects.bounces > 0;
    if (row.effect == "color") row.needed = plan.effects.color;
    if (row.effect == "gloss") row.needed = plan.effects.gloss;
    if (row.effect == "view dependence" && options.vertices) row.needed = plan.effects.gloss;
    if (row.effect == "specular") row.needed = plan.effects.specular;
    if (row.effect == "caustics") row.needed = plan.effects.caustics;
  }
  if (probe) plan.rays = probe->rays();
  plan.look_seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  if (options.costs) {
    CostMeter meter(source, order, options);
    const Cost all = meter.of(possible);
    plan.all_seconds = all.seconds;
    plan.all_bytes = all.bytes;
    const Cost mine = plan.effects == possible ? all : meter.of(plan.effects);
    plan.seconds = mine.seconds;
    plan.bytes = mine.bytes;
    for (const Candidate& c : candidates) {
      const Cost with = c.with == possible ? all : meter.of(c.with);
      const Cost without = c.without == plan.effects ? mine : meter.of(c.without);
      plan.rows[c.row].seconds = with.seconds - without.seconds;
      plan.rows[c.row].bytes = with.bytes - without.bytes;
    }
    plan.pilot_rays = meter.rays();
  }
  return plan;
}

std::string to_json(const Plan& plan, bool costs) {
  nlohmann::json rows = nlohmann::json::array();
  for (const EffectEstimate& r : plan.rows) {
    nlohmann::json row{
        {"effect", r.effect}, {"needed", r.needed}, {"why", r.why}, {"error", r.error}};
    if (costs) row["seconds"] = r.seconds, row["bytes"] = r.bytes;
    rows.push_back(row);
  }
  nlohmann::json json{{"effects", to_string(plan.effects)}, {"rows", rows}, {"error", plan.error}};
  if (costs) {
    json["seconds"] = plan.seconds, json["bytes"] = plan.bytes;
    json["all_seconds"] = plan.all_seconds, json["all_bytes"] = plan.all_bytes;
    json["look_seconds"] = plan.look_seconds;
    json["rays"] = plan.rays, json["pilot_rays"] = plan.pilot_rays;
  }
  return json.dump();
}

}  // namespace haarlight
