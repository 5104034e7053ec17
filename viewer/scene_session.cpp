// A scene that moves, played and taken hold of.

#include "viewer/scene_session.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "caching/caching_method.h"
#include "caching/path_picture.h"
#include "viewer/session.h"

namespace haarlight::viewer {

SceneSession::SceneSession(const std::filesystem::path& file, const SceneSettings& settings)
    : scene_(file), settings_(settings), frames_(scene_.frames()) {
  frame_ = settings.first % frames_;
  if (!settings.env.empty()) {
    scene_.set_environment(
        std::make_shared<const EnvironmentLight>(load_environment(settings.env)));
  }
  view_.width = settings.width, view_.height = settings.height;
  look();
}

SceneSession::~SceneSession() = default;

void SceneSession::step(int frames) {
  playing_ = false;
  frame_ = ((frame_ + frames) % frames_ + frames_) % frames_;
  changed_ = true;
}

void SceneSession::set_method(SceneMethod method) {
  changed_ = changed_ || method != settings_.method;
  settings_.method = method;
  method_.reset(), instant_.reset();
}

void SceneSession::show_life(bool on) {
  changed_ = changed_ || on != settings_.show_life;
  settings_.show_life = on;
}

void SceneSession::orbit(double turn, double rise, double closer) {
  view_.orbit += turn, view_.elevation += rise;
  view_.closer = std::clamp(view_.closer + closer, -6.0, 6.0);
  changed_ = touched_ = true;
}

const FrameTracer& SceneSession::tracer() const {
  if (!tracer_) tracer_ = std::make_unique<FrameTracer>(*now_);
  return *tracer_;
}

// The frame, and from where it is seen.
void SceneSession::look() {
  tracer_.reset();
  scene_.set_camera({});
  now_ = std::make_unique<AnimatedFrame>(scene_.at(frame_));
  camera_ = frame_camera(*now_, width(), height());
  if (!middle_) {
    const Visibility& visibility = tracer().visibility();
    const Vec3 way = camera_.direction(0.5 * camera_.width, 0.5 * camera_.height);
    const auto hit = visibility.first_hit(visibility.to_local(camera_.position), way);
    middle_ = camera_.position + way * (hit ? visibility.to_world_length(hit->distance) : 2.0);
  }
  if (view_.orbit == 0 && view_.elevation == 0 && view_.closer == 0) return;
  camera_ = orbit_camera(camera_, {*middle_, 0}, view_);
  scene_.set_camera(camera_);
  now_->scene.camera = camera_;
}

std::optional<std::array<double, 2>> SceneSession::pixel_of(const Vec3& world) const {
  const Vec3 p = camera_.orientation.transposed() * (world - camera_.position);
  if (!(p.z < -1e-6)) return std::nullopt;
  const double scale = camera_.height / (2 * std::tan(0.5 * camera_.vertical_fov) * -p.z);
  return std::array{0.5 * camera_.width + p.x * scale, 0.5 * camera_.height - p.y * scale};
}

std::vector<std::array<double, 2>> SceneSession::lamps_seen() const {
  std::vector<std::array<double, 2>> seen;
  for (const SceneLight& light : now_->light) {
    if (light.kind == SceneLight::Kind::directional) continue;
    if (const auto pixel = pixel_of(light.position)) seen.push_back(*pixel);
  }
  return seen;
}

std::optional<SceneSession::Grab> SceneSession::grab(double x, double y) const {
  constexpr double kNear = 10;  // pixels
  const std::vector<std::uint32_t> lamps = scene_.light_nodes();
  for (std::size_t n = 0; n < now_->light.size(); ++n) {
    const SceneLight& light = now_->light[n];
    const auto pixel = pixel_of(light.position);
    if (light.kind == SceneLight::Kind::directional || !pixel) continue;
    if (std::hypot((*pixel)[0] - x, (*pixel)[1] - y) > kNear) continue;
    return Grab{lamps[n], true, light.position, scene_.carried(lamps[n])};
  }
  const Visibility& visibility = tracer().visibility();
  const Vec3 way = camera_.direction(x, y);
  const auto hit = visibility.first_hit(visibility.to_local(camera_.position), way);
  if (!hit) return std::nullopt;
  const std::uint32_t node = scene_.instance_of(hit->triangle);
  // A body that one stands in the midst of is a room, flat walls included.
  constexpr double kMax = std::numeric_limits<double>::max();
  Vec3 low{kMax, kMax, kMax}, high{-kMax, -kMax, -kMax};
  for (std::uint32_t t = 0; t < scene_.triangle_count(); ++t) {
    if (scene_.instance_of(t) != node) continue;
    for (const std::uint32_t v : now_->scene.triangle[t].vertex) {
      const Vec3& p = now_->scene.position[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  const Vec3& eye = camera_.position;
  const int about = (low.x < eye.x && eye.x < high.x) + (low.y < eye.y && eye.y < high.y) +
                    (low.z < eye.z && eye.z < high.z);
  if (about >= 2) return std::nullopt;
  return Grab{node, false, eye + way * visibility.to_world_length(hit->distance),
              scene_.carried(node)};
}

void SceneSession::drag(const Grab& grab, double x, double y) {
  const Vec3 forward = camera_.orientation * Vec3{0, 0, -1};
  const Vec3 way = camera_.direction(x, y);
  const double depth = dot(grab.point - camera_.position, forward);
  const double along = dot(way, forward);
  if (!(along > 1e-6)) return;
  const Vec3 there = camera_.position + way * (depth / along);
  scene_.carry(grab.node, grab.before + there - grab.point);
  changed_ = touched_ = true;
}

// Adds to what there is.
void SceneSession::draw_paths() {
  if (changed_) samples_ = 0, sum_.clear(), life_ = {};
  PathPictureOptions options;
  options.width = width(), options.height = height();
  options.samples = settings_.samples;
  options.seed = static_cast<std::uint64_t>(samples_) + 1;
  const Image more = path_picture(tracer(), options);
  sum_.resize(more.pixels.size());
  samples_ += settings_.samples;
  if (picture_.width != more.width || picture_.height != more.height) picture_ = more;
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    sum_[i] += RgbD(more.pixels[i]) * static_cast<double>(settings_.samples);
    picture_.pixels[i] = Rgb(sum_[i] * (1.0 / samples_));
  }
}

void SceneSession::draw_virtual_lights() {
  if (!instant_) {
    InstantOptions options;
    options.kind = settings_.method == SceneMethod::igi  ? InstantKind::igi
                   : settings_.method == SceneMethod::ic ? InstantKind::ic
                                                         : InstantKind::tic;
    instant_ = std::make_unique<InstantMethod>(scene_, options);
  }
  instant_->set_size(width(), height());
  instant_->show_life(settings_.show_life);
  take(instant_->draw(*now_, {}));
}

// A cache goes on from frame to frame; what a hand has done it could not foresee.
void SceneSession::draw_records() {
  if (!method_ || touched_ || frame_ != drawn_ + 1) {
    CachingOptions options;
    options.width = settings_.width, options.height = settings_.height;
    options.temporal = settings_.method == SceneMethod::trc;
    options.gradients = TemporalGradients::extrapolated;
    options.show_life = true;  // costs nothing beside the rest
    method_ = std::make_unique<CachingMethod>(scene_, options);
  }
  take(method_->frame(frame_, {}));
  drawn_ = frame_;
}

void SceneSession::take(FramePicture drawn) {
  picture_ = std::move(drawn.radiance);
  life_ = {};
  if (settings_.show_life && !drawn.extra.empty()) life_ = std::move(drawn.extra[0].picture);
  samples_ = 0;
}

// As large as keeps the rate while something moves, else in full.
void SceneSession::choose_size(bool moves) {
  const bool may = settings_.method == SceneMethod::path || is_instant();
  if (!moves || !may || !(settings_.least_rate > 0)) {
    coarse_ = 1;
    return;
  }
  // A picture of four times the pixels takes less than four times as long.
  constexpr double kFiner = 3.5;
  const double time = seconds_ * settings_.least_rate;
  if (time > 1 && coarse_ < kCoarsest) {
    coarse_ *= 2;
  } else if (time * kFiner < 1 && coarse_ > 1) {
    coarse_ /= 2;
  }
}

bool SceneSession::advance() {
  using Clock = std::chrono::steady_clock;
  if (playing_ && begun_) {
    frame_ = (frame_ + 1) % frames_;
    changed_ = true;
  }
  const bool moves = begun_ && (playing_ || touched_);
  changed_ = changed_ || (coarse_ > 1 && !moves);  // in full, now that it rests
  const bool better = settings_.method == SceneMethod::path && samples_ < kMostSamples;
  if (!changed_ && !better) return false;
  if (changed_) {
    choose_size(moves);
    look();
  }
  const auto begin = Clock::now();
  if (settings_.method == SceneMethod::path) {
    draw_paths();
  } else if (is_instant()) {
    draw_virtual_lights();
  } else {
    draw_records();
  }
  const std::chrono::duration<double> span = Clock::now() - begin;
  seconds_ = span.count();
  changed_ = touched_ = false;
  begun_ = true;
  return true;
}

}  // namespace haarlight::viewer
