// Relights and draws a mesh from its clusters' vectors.

#include "cpca/cluster_relighter.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "prt/mesh_picture.h"
#include "prt/picture_relighter.h"
#include "prt/term_finish.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

int quarter(const ClusterWeights& weights) {
  std::uint32_t most = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(weights.clusters()); ++c) {
    most = std::max(most, weights.vectors_of(c));
  }
  return std::max(1, static_cast<int>(most / 4));
}

}  // namespace

struct ClusterRelighter::State {
  State(const Transport& transport, ClusterRelightOptions wanted)
      : options(wanted),
        vectors(transport),
        vertices(transport.info()),
        drawing(transport.info().mesh),
        camera(transport.info().camera) {}

  void find_seen();
  void draw(bool changed);

  ClusterRelightOptions options;
  RowSums vectors;
  ClusterSums vertices;
  MeshPicture drawing;
  std::optional<TermFinish> finish;
  std::vector<std::uint8_t> changed_chunks;
  std::vector<std::uint32_t> cluster_of;  // [vertex]
  std::vector<std::uint8_t> seen;         // [cluster]
  std::vector<Rgb> sums, radiance;
  Image picture;
  Camera camera;
  CombineStats combined;
  double combine_ms = 0;
  int terms_a_frame = 1;
  bool exact = false, looked = false, shaded = false;
};

// Clusters with a vertex of a triangle that some pixel sees.
void ClusterRelighter::State::find_seen() {
  std::fill(seen.begin(), seen.end(), std::uint8_t{0});
  const auto& triangles = vectors.transport().info().mesh->triangle;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      for (const MeshPicture::Fragment& fragment : drawing.fragments(x, y)) {
        for (const std::uint32_t v : triangles[fragment.triangle]) seen[cluster_of[v]] = 1;
      }
    }
  }
}

void ClusterRelighter::State::draw(bool changed) {
  if (shaded && !changed) return;
  if (finish) finish->shade(sums, radiance);
  drawing.shade(finish ? radiance : sums, picture);
  shaded = true;
}

ClusterRelighter::ClusterRelighter(const Transport& transport, ClusterRelightOptions options) {
  const TransportInfo& info = transport.info();
  if (info.kind != TransportKind::clusters) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of pixels or vertices, expected one of clusters");
  }
  if (info.terms != 1 && !info.view) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("the transport has {} terms a vertex and no view factors, expected 1 "
                            "or factors",
                            info.terms));
  }
  if (options.basis_terms < -1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("basis_terms is {}, expected -1 (all), 0 (a quarter) or more",
                            options.basis_terms));
  }
  state_ = std::make_unique<State>(transport, options);
  State& s = *state_;
  const ClusterWeights& weights = *info.clusters;
  s.terms_a_frame = options.basis_terms > 0    ? options.basis_terms
                    : options.basis_terms == 0 ? quarter(weights)
                                               : 0;
  s.changed_chunks.assign(static_cast<std::size_t>(transport.chunk_count()), 0);
  s.seen.assign(static_cast<std::size_t>(weights.clusters()), 1);
  s.cluster_of.resize(weights.vertex.size());
  for (std::size_t c = 0; c < s.seen.size(); ++c) {
    for (std::uint32_t place = weights.first_vertex[c]; place < weights.first_vertex[c + 1];
         ++place) {
      s.cluster_of[weights.vertex[place]] = static_cast<std::uint32_t>(c);
    }
  }
  const std::size_t vertices = info.mesh->position.size();
  s.sums.assign(vertices * static_cast<std::size_t>(info.terms), Rgb{});
  if (info.view) {
    s.finish.emplace(info.mesh, info.view);
    s.radiance.resize(vertices);
  }
}

ClusterRelighter::~ClusterRelighter() = default;

void ClusterRelighter::set_camera(const Camera& camera) {
  State& s = *state_;
  if (camera == s.camera) return;
  s.camera = camera;
  s.looked = s.shaded = false;
}

RelightStats ClusterRelighter::apply(const LightingUpdate& update) {
  State& s = *state_;
  RelightStats stats;

  // Step 1: vectors follow the light, whatever comes of looking: the tracker has moved on.
  const Clock::time_point begin = Clock::now();
  const auto mark = [&s](int chunk, const double*) {
    s.changed_chunks[static_cast<std::size_t>(chunk)] = 1;
  };
  stats.apply = s.vectors.apply(update, std::ref(mark));
  const Clock::time_point applied = Clock::now();

  // Where each pixel looks says which clusters matter.
  if (!s.looked) {
    s.drawing.look(s.camera);
    if (s.finish) s.finish->look(s.camera.position);
    if (s.options.skip_unseen) s.find_seen();
    s.looked = true;
  }
  const Clock::time_point looked = Clock::now();

  // Step 2: vertices follow the vectors.
  s.combined = s.vertices.follow(s.vectors, s.changed_chunks,
                                 s.options.skip_unseen ? std::span<const std::uint8_t>(s.seen)
                                                       : std::span<const std::uint8_t>(),
                                 s.exact ? 0 : s.terms_a_frame, s.sums);
  std::fill(s.changed_chunks.begin(), s.changed_chunks.end(), std::uint8_t{0});
  stats.apply.transport_bytes += s.combined.weight_bytes;
  stats.apply.sum_bytes += s.combined.sum_bytes;
  const Clock::time_point combined = Clock::now();
  s.combine_ms = milliseconds(looked, combined);

  // Step 3: view factors, picture.
  s.draw(s.combined.changes > 0);
  stats.apply_ms = milliseconds(begin, applied) + milliseconds(looked, combined);
  stats.finish_ms = milliseconds(applied, looked) + milliseconds(combined, Clock::now());
  return stats;
}

void ClusterRelighter::expect_resets(bool expected) { state_->vectors.expect_resets(expected); }
void ClusterRelighter::keep_logs_short(bool keep) { state_->vectors.keep_logs_short(keep); }
const RowSums* ClusterRelighter::row_sums() const { return &state_->vectors; }
void ClusterRelighter::set_exact(bool exact) { state_->exact = exact; }
bool ClusterRelighter::settled() const { return state_->vertices.settled(); }
const Camera& ClusterRelighter::camera() const { return state_->camera; }
const Image& ClusterRelighter::picture() const { return state_->picture; }
std::span<const float> ClusterRelighter::coverage() const { return state_->drawing.coverage(); }
const Transport& ClusterRelighter::transport() const { return state_->vectors.transport(); }
void ClusterRelighter::vertex_weights(std::vector<float>& weights) const {
  state_->drawing.vertex_weights(weights);
}
std::span<const Rgb> ClusterRelighter::view_factors() const {
  return state_->finish ? state_->finish->factors() : std::span<const Rgb>();
}
void ClusterRelighter::pending_rows(std::vector<double>& rows) const {
  rows.clear();
  if (!settled()) state_->vertices.pending(state_->vectors, rows);
}
std::span<const Rgb> ClusterRelighter::sums() const { return state_->sums; }
const CombineStats& ClusterRelighter::combine_stats() const { return state_->combined; }
double ClusterRelighter::combine_ms() const { return state_->combine_ms; }
std::span<const std::uint8_t> ClusterRelighter::seen() const { return state_->seen; }

RelighterFactory any_relighter(ClusterRelightOptions options) {
  return [options](const Transport& transport) -> std::unique_ptr<Relighter> {
    if (transport.kind() == TransportKind::clusters) {
      return std::make_unique<ClusterRelighter>(transport, options);
    }
    return std::make_unique<PictureRelighter>(transport);
  };
}

}  // namespace haarlight
