// Relights either kind of transport and looks at it.

#include "prt/picture_relighter.h"

#include <fmt/format.h>

#include <chrono>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "core/error.h"
#include "prt/image_relighter.h"
#include "prt/mesh_picture.h"
#include "prt/mesh_relighter.h"
#include "prt/term_finish.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

bool same(const Camera& a, const Camera& b) {
  return a.position == b.position && a.orientation.row == b.orientation.row &&
         a.vertical_fov == b.vertical_fov && a.width == b.width && a.height == b.height;
}

}  // namespace

struct PictureRelighter::State {
  // One of the two, by the kind.
  std::optional<ImageRelighter> image;
  std::optional<MeshRelighter> vertices;
  std::optional<MeshPicture> drawing;
  std::optional<TermFinish> finish;  // of a mesh with view factors
  std::vector<Rgb> radiance;         // what it finds
  Image picture;                     // of the mesh
  Camera camera;
  bool looked = false, shaded = false;
  UpdatePart next = UpdatePart::whole;  // rest: a first part was applied

  void draw(bool changed);
};

// What changed by light or view, in this order: factors and pixels, radiance, picture.
void PictureRelighter::State::draw(bool changed) {
  if (!looked) {
    drawing->look(camera);
    if (finish) finish->look(camera.position);
  }
  looked = true;
  if (shaded && !changed) return;
  if (finish) finish->shade(vertices->radiance(), radiance);
  drawing->shade(finish ? std::span<const Rgb>(radiance) : vertices->radiance(), picture);
  shaded = true;
}

PictureRelighter::PictureRelighter(const Transport& transport) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.camera = transport.info().camera;
  if (transport.kind() == TransportKind::image) {
    s.image.emplace(transport);
    return;
  }
  const TransportInfo& info = transport.info();
  if (info.clusters) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of clusters, expected one of a picture or a mesh");
  }
  if (info.terms != 1 && !info.view) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("the transport has {} terms a vertex and no view factors, expected 1 "
                            "or factors",
                            info.terms));
  }
  s.vertices.emplace(transport);
  s.drawing.emplace(info.mesh);
  if (info.view) {
    s.finish.emplace(info.mesh, info.view);
    s.radiance.resize(info.mesh->position.size());
  }
}

PictureRelighter::~PictureRelighter() = default;
PictureRelighter::PictureRelighter(PictureRelighter&&) noexcept = default;
PictureRelighter& PictureRelighter::operator=(PictureRelighter&&) noexcept = default;

void PictureRelighter::set_camera(const Camera& camera) {
  State& s = *state_;
  if (same(camera, s.camera)) return;
  if (s.image) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of one view, expected its own camera");
  }
  s.camera = camera;
  s.looked = s.shaded = false;
}

RelightStats PictureRelighter::apply(const LightingUpdate& update) {
  State& s = *state_;
  const UpdatePart part = std::exchange(s.next, UpdatePart::whole);
  if (s.image) return s.image->apply(update, part);
  RelightStats stats = s.vertices->apply(update, part);
  const Clock::time_point begin = Clock::now();
  s.draw(!update.empty() || part == UpdatePart::rest);
  stats.finish_ms += std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
  return stats;
}

RelightStats PictureRelighter::apply_first(const LightingUpdate& update) {
  State& s = *state_;
  s.next = UpdatePart::rest;
  return s.image ? s.image->apply(update, UpdatePart::first)
                 : s.vertices->apply(update, UpdatePart::first);
}

void PictureRelighter::expect_resets(bool expected) {
  if (state_->image) {
    state_->image->expect_resets(expected);
  } else {
    state_->vertices->expect_resets(expected);
  }
}

void PictureRelighter::keep_logs_short(bool keep) {
  if (state_->image) {
    state_->image->keep_logs_short(keep);
  } else {
    state_->vertices->keep_logs_short(keep);
  }
}

const Camera& PictureRelighter::camera() const { return state_->camera; }

const Image& PictureRelighter::picture() const {
  return state_->image ? state_->image->picture() : state_->picture;
}

std::span<const float> PictureRelighter::coverage() const {
  return state_->image ? state_->image->transport().coverage() : state_->drawing->coverage();
}

const Transport& PictureRelighter::transport() const {
  return state_->image ? state_->image->transport() : state_->vertices->transport();
}

void PictureRelighter::vertex_weights(std::vector<float>& weights) const {
  weights.clear();
  if (state_->drawing) state_->drawing->vertex_weights(weights);
}

std::span<const Rgb> PictureRelighter::view_factors() const {
  return state_->finish ? state_->finish->factors() : std::span<const Rgb>();
}

const RowSums* PictureRelighter::row_sums() const {
  return state_->image ? &state_->image->sums() : &state_->vertices->sums();
}

}  // namespace haarlight
