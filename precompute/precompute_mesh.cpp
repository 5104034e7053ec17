// The offline main path for meshes: a scene in, a transport of its vertices out.

#include "precompute/precompute_mesh.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "precompute/distribution.h"
#include "precompute/fingerprint.h"
#include "precompute/mesh_tiles.h"
#include "precompute/run_checks.h"
#include "precompute/scene_meta.h"
#include "precompute/scene_notes.h"
#include "precompute/tile_run.h"
#include "precompute/vertex_sampler.h"

namespace haarlight {
namespace {

// Part of the fingerprint: raised whenever the same input would give other vertices.
constexpr int kVertexVersion = 2;

constexpr double kSubdivisionShare = 0.1;  // of the progress shown

// What the file says of its terms: a material's name, how many it has and what they leave of it.
nlohmann::json terms_meta(const Scene& scene, const VertexTerms& terms,
                          const TermOptions& options) {
  nlohmann::json meta{
      {"asked", options.terms > 0 ? nlohmann::json(options.terms) : nlohmann::json("auto")},
      {"error_wanted", options.error}};
  for (const TermSet& set : terms.set) {
    meta["materials"].push_back({{"name", scene.material[set.material].name},
                                 {"terms", set.terms()},
                                 {"error", set.error}});
  }
  return meta;
}

}  // namespace

TransportMesh transport_mesh(const Scene& scene) {
  TransportMesh mesh;
  if (scene.position.empty()) return mesh;
  Vec3 low = scene.position[0], high = low;
  for (const Vec3& p : scene.position) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  mesh.origin = 0.5 * (low + high);
  const auto narrow = [](const Vec3& v) {
    return std::array<float, 3>{static_cast<float>(v.x), static_cast<float>(v.y),
                                static_cast<float>(v.z)};
  };
  mesh.material.assign(scene.position.size(), 0);
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    mesh.position.push_back(narrow(scene.position[v] - mesh.origin));
    mesh.normal.push_back(narrow(scene.normal[v]));
  }
  for (const Triangle& t : scene.triangle) {
    mesh.triangle.push_back(t.vertex);
    for (const std::uint32_t v : t.vertex) mesh.material[v] = t.material;
  }
  return mesh;
}

std::string mesh_fingerprint(const Scene& scene, const Camera& camera, const MeshOptions& options) {
  ContentHash hash;
  hash.add(kVertexVersion);
  hash.add(precompute_fingerprint(scene, camera, options));
  hash.add(options.subdivide), hash.add(options.max_vertices);
  const TermOptions& t = options.terms;
  hash.add(t.terms), hash.add(t.error), hash.add(t.most), hash.add(t.apart);
  return hash.text();
}

MeshReport precompute_mesh(const Scene& scene, const Camera& camera, const MeshOptions& options,
                           const std::filesystem::path& file, const Progress& progress) {
  MeshReport report;
  std::optional<Scene> fine;
  std::optional<Visibility> visibility;
  std::optional<VertexSampler> sampler;
  std::optional<VertexTerms> terms;
  std::optional<MeshTiles> tiles;
  TileRun run;
  const double first = options.subdivide ? kSubdivisionShare : 0;
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  together(options.distribution, [&] {
    check(static_cast<const RunOptions&>(options));
    check(options.trace);
    check(options.terms);
    check(camera);
    check_output(file);

    // More vertices where the light on them changes.
    visibility.emplace(scene);
    SubdivideOptions finer;
    finer.tolerance = std::max(0.005, options.error);
    finer.max_vertices = options.max_vertices;
    const auto subdividing = [&](double share) { return !progress || progress(first * share); };
    fine = options.subdivide
               ? subdivide(scene, *visibility, finer, &report.subdivision, subdividing)
               : scene;
    report.subdivision.vertices = static_cast<std::int64_t>(fine->position.size());
    report.subdivision.triangles = static_cast<std::int64_t>(fine->triangle.size());
    report.subdivision_seconds = seconds();

    sampler.emplace(*fine, *visibility);
    report.view_dependent = sampler->view_dependent();
    if (options.trace.effects.gloss && report.view_dependent > 0) {
      terms = vertex_terms(*fine, sampler->materials(), options.terms);
      sampler->set_terms(&*terms);
      report.terms = terms->terms;
      report.terms_error = terms->worst_error;
      report.terms_material = terms->worst_material;
      run.info.terms = terms->terms;
      run.info.view = terms->view;
    }
    tiles.emplace(*sampler, scene, *visibility, options.trace);
    run.info.kind = TransportKind::mesh;
    run.info.face_size = options.trace.face_size;
    run.info.width = camera.width;
    run.info.height = camera.height;
    run.info.camera = camera;
    run.info.mesh = std::make_shared<const TransportMesh>(transport_mesh(*fine));
    run.fingerprint = mesh_fingerprint(scene, camera, options);
    nlohmann::json meta = run_meta(scene, options, file, run.fingerprint);
    meta["options"]["subdivide"] = options.subdivide;
    meta["options"]["max_vertices"] = options.max_vertices;
    meta["view_dependent_vertices"] = report.view_dependent;
    if (terms) meta["terms"] = terms_meta(scene, *terms, options.terms);
    run.meta = meta_text(meta);
  });
  RunOptions rest = options;
  if (rest.time_limit > 0) rest.time_limit = std::max(0.01, rest.time_limit - seconds());
  const auto tracing = [&](double share) {
    return !progress || progress(first + (1 - first) * share);
  };
  report.run = run_tiles(*tiles, run, rest, file, tracing);
  report.run.notes = scene_notes(scene, *visibility, nullptr);
  return report;
}

}  // namespace haarlight
