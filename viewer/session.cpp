// Runs a session frame by frame.

#include "viewer/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "core/image_io.h"
#include "core/image_metrics.h"
#include "core/parallel.h"
#include "cpca/cluster_relighter.h"
#include "prt/image_relighter.h"
#include "prt/motion_background.h"
#include "prt/tonemap.h"
#include "viewer/lighting_picture.h"

namespace haarlight::viewer {
namespace {

constexpr int kPreviewHeight = 512;
constexpr int kMotionStop = 99;      // frames of the comparison's motions
constexpr int kRestTicks = 60;       // a looping motion rests for a second
constexpr int kSubFrames = 1 << 12;  // a motion's position is rounded to this part of a frame

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

/// Motions count in whole frames: the same motion in parts of a frame. Multiplying frame and stop
/// by a power of two changes no bit of their quotient.
MotionOptions fine_motion(const ViewSettings& settings) {
  return {.kind = settings.motion, .degrees = settings.degrees, .stop = kMotionStop * kSubFrames};
}

int fine_frame(double position) { return static_cast<int>(std::lround(position * kSubFrames)); }

void check(const ViewSettings& s) {
  const auto refuse = [](const char* what, auto value, const char* wanted) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} is {}, expected {}", what, value, wanted));
  };
  if (s.wavelets < 1 || s.wavelets > kMaxWavelets) refuse("wavelets", s.wavelets, "1 to 1048576");
  if (!(s.milliseconds > 0)) refuse("milliseconds", s.milliseconds, "more than 0");
  if (!(s.error > 0)) refuse("error", s.error, "more than 0");
  if (!(s.speed >= 0 && s.speed <= 1000)) refuse("speed", s.speed, "0 to 1000");
  if (!std::isfinite(s.yaw) || !std::isfinite(s.pitch)) refuse("yaw", s.yaw, "finite angles");
  if (!std::isfinite(s.orbit) || !(std::abs(s.elevation) <= kPi)) {
    refuse("elevation", s.elevation, "finite angles");
  }
  if (!(std::abs(s.closer) <= 6)) refuse("closer", s.closer, "-6 to 6");
  if (!(std::abs(s.right) <= 100 && std::abs(s.up) <= 100)) refuse("right", s.right, "-100 to 100");
  if (s.disc_count < 0 || s.disc_count > kMaxDiscs) refuse("lights", s.disc_count, "0 to 8");
}

}  // namespace

Image latlong_preview(const Environment& environment, int height) {
  Image preview(2 * height, height);
  parallel_for(height, [&](int y) {
    for (int x = 0; x < preview.width; ++x) {
      const auto direction = projection_direction(Projection::latlong, (x + 0.5) / preview.width,
                                                  (y + 0.5) / preview.height);
      preview.at(x, y) = environment.radiance(*direction);
    }
  });
  return preview;
}

Camera orbit_camera(const Camera& file, const BoundingSphere& middle,
                    const ViewSettings& settings) {
  Camera camera = turned_about(file, middle.center, settings.orbit);
  if (settings.elevation != 0) {
    // Up and over, about the camera's own right, stopping short of the poles.
    const Vec3 away = camera.position - middle.center;
    const double distance = std::max(length(away), 1e-9);
    const double now = std::asin(std::clamp(away.y / distance, -1.0, 1.0));
    const double most = 0.49 * kPi;
    const double turn = std::clamp(now + settings.elevation, -most, most) - now;
    const Rotation t = camera.orientation.transposed();
    const Vec3 right = normalize(Vec3{t.row[0].x, 0, t.row[0].z});
    // The rotation about `right`: to a frame with it as +X, about that, and back.
    const Vec3 up{0, 1, 0}, back = cross(right, up);
    const Rotation frame{{right, up, back}};
    const Rotation over = frame.transposed() * rotation_x(-turn) * frame;
    camera.position = middle.center + over * away;
    camera.orientation = over * camera.orientation;
  }
  camera.position = middle.center + (camera.position - middle.center) * std::exp2(-settings.closer);
  const double height =
      2 * std::tan(0.5 * camera.vertical_fov) * length(camera.position - middle.center);
  camera.position = camera.position +
                    camera.orientation * Vec3{-settings.right * height, -settings.up * height, 0};
  if (settings.width > 0) camera.width = settings.width;
  if (settings.height > 0) camera.height = settings.height;
  return camera;
}

Session::Session() = default;
Session::~Session() = default;

void Session::act(const ViewAction& action) {
  struct Actor {
    Session& s;
    void operator()(const OpenTransport& open) const { s.open_transport(open.file); }
    void operator()(const OpenEnvironment& open) const { s.open_environment(open); }
    void operator()(const SetBlend& set) const {
      if (!(set.blend >= 0 && set.blend <= 1)) {
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("blend is {}, expected 0 to 1", set.blend));
      }
      if (s.to_ >= 0) s.blend_ = set.blend;
      s.fade_ = 0;
    }
    void operator()(const Restart& restart) const { s.next_start_ = restart.start; }
    void operator()(const Rewind&) const {
      s.position_ = 0;
      s.rested_ = 0;
    }
    void operator()(const Step&) const { s.stepping_ = true; }
    void operator()(const StartRecording&) const { s.start_recording(); }
    void operator()(const StopRecording& stop) const {
      if (s.recording_.frames.empty()) {
        throw Error(ErrorKind::invalid_argument,
                    stop.file.string() + ": nothing was recorded, expected at least one frame");
      }
      s.recording_now_ = false;
      save_motion_file(stop.file, s.recording_);
    }
    void operator()(const SavePicture& save) const {
      if (s.frames_ == 0) {
        throw Error(ErrorKind::missing, save.file.string() +
                                            ": no picture to save, expected a transport and an "
                                            "environment to be open");
      }
      const Image picture = s.picture_with_background();
      check_finite(picture, save.file.string());
      save_image(save.file, picture);
    }
  };
  std::visit(Actor{*this}, action);
  fresh_ = true;
}

void Session::open_transport(const std::filesystem::path& file) {
  auto scene = std::make_shared<OpenScene>(OpenScene{file, Transport::open(file)});
  // Everything that can fail is made first, so that a file that does not open changes nothing.
  LightRig rig(scene->transport.layout());
  for (std::size_t i = 0; i < lights_.size(); ++i) rig.set_environment(i, lights_[i]->environment);
  FrameRelighter relighter(scene->transport, {}, WaveletWeight::area, any_relighter());
  relighter.judge_errors(true);
  const auto& mesh = scene->transport.info().mesh;
  middle_ = mesh ? bounding_sphere(*mesh) : BoundingSphere{};
  scene_ = std::move(scene);
  ++view_number_;
  camera_.reset();
  rig_.emplace(std::move(rig));
  relighter_.emplace(std::move(relighter));
  next_start_ = FrameStart::exact;
  exposure_.reset();
  colours_.reset();
  clusters_.pixels.clear();
  recording_now_ = false;
}

void Session::open_environment(const OpenEnvironment& open) {
  Environment environment = load_environment(open.file);
  Image preview = latlong_preview(environment, kPreviewHeight);
  auto light =
      std::make_shared<OpenLight>(OpenLight{open.file, std::move(environment), std::move(preview)});

  // What is mostly seen stays as the first one; the new one takes a place that neither needs. A
  // recording needs all of them.
  const int stays = to_ >= 0 && blend_ > 0.5 ? to_ : from_;
  std::size_t slot = lights_.size();
  for (std::size_t i = 0; i < lights_.size() && !recording_now_; ++i) {
    if (static_cast<int>(i) != stays) slot = i;
  }
  if (rig_) rig_->set_environment(slot, light->environment);
  if (slot == lights_.size()) {
    lights_.push_back(std::move(light));
  } else {
    lights_[slot] = std::move(light);
  }
  if (recording_now_) recording_.environments.push_back(std::filesystem::absolute(open.file));
  if (from_ < 0) {
    from_ = static_cast<int>(slot);
    return;
  }
  from_ = stays;
  to_ = static_cast<int>(slot);
  blend_ = 0;
  fade_ = open.fade > 0 ? 1 / open.fade : 0;
}

void Session::start_recording() {
  if (!ready()) {
    throw Error(ErrorKind::missing,
                "nothing to record, expected a transport and an environment to be open");
  }
  recording_ = {};
  for (const auto& light : lights_) {
    recording_.environments.push_back(std::filesystem::absolute(light->file));
  }
  recording_now_ = true;
  // What came before is in no file: begin from what the target alone says.
  next_start_ = FrameStart::exact;
}

// The light of the frame from hand, motion and blend.
void Session::set_light(const ViewSettings& settings) {
  const MotionOptions motion = fine_motion(settings);
  const int frame = fine_frame(position_);
  light_.from = from_;
  light_.to = to_ >= 0 ? to_ : from_;
  light_.blend = blend_;
  if (settings.motion == MotionKind::blend && to_ >= 0 && (settings.playing || position_ > 0)) {
    light_.blend = std::min(position_ / kMotionStop, 1.0);
  }
  light_.background = settings.background;
  light_.rotation =
      rotation_y(settings.yaw) * rotation_x(settings.pitch) * motion_rotation(motion, frame);
  light_.discs.assign(settings.discs.begin(), settings.discs.begin() + settings.disc_count);
  if (settings.motion == MotionKind::light && (settings.playing || position_ > 0)) {
    light_.background *= kDiscBackgroundShare;
    light_.discs.push_back({motion_disc_center(motion, frame),
                            std::acos(kDiscCosine),
                            {kDiscRadiance, kDiscRadiance, kDiscRadiance}});
  }
}

void Session::set_view(const ViewSettings& settings) {
  if (!scene_->transport.info().mesh) return;
  const Camera camera = orbit_camera(scene_->transport.info().camera, middle_, settings);
  if (camera_ && *camera_ == camera) return;
  camera_ = camera;
  ++view_number_;
  relighter_->set_camera(camera);
}

FrameBudget Session::budget(const ViewSettings& settings) const {
  if (settings.budget == BudgetKind::milliseconds) return {settings.budget, settings.milliseconds};
  if (settings.budget == BudgetKind::error && relighter_->can_judge()) {
    return {settings.budget, settings.error};
  }
  return {};
}

void Session::move_on(const ViewSettings& settings, double ticks) {
  if (fade_ > 0) {
    blend_ = std::min(1.0, blend_ + fade_ * ticks);
    if (blend_ == 1) fade_ = 0;
  }
  const double step = settings.playing ? ticks * settings.speed : stepping_ ? 1.0 : 0.0;
  stepping_ = false;
  if (step <= 0) return;
  position_ = std::min(position_ + step, static_cast<double>(kMotionStop));
  if (position_ < kMotionStop || !settings.loop) return;
  if (settings.motion == MotionKind::swing || settings.motion == MotionKind::light) {
    position_ = 0;  // ends where it began
  } else if (++rested_ >= kRestTicks) {
    position_ = 0;
    rested_ = 0;
  }
}

bool Session::resting(const ViewSettings& settings) const {
  if (!ready()) return true;
  const bool moving = settings.playing && settings.speed > 0 &&
                      settings.motion != MotionKind::still &&
                      (settings.loop || position_ < kMotionStop);
  return converged_ && !fresh_ && !moving && fade_ == 0 && !stepping_ && settings == last_;
}

bool Session::advance(const ViewSettings& settings, double ticks, ViewFrame& out) {
  check(settings);
  if (!ready()) return false;
  const auto light_begin = std::chrono::steady_clock::now();
  set_light(settings);
  const std::span<const Rgb> target = rig_->coefficients(light_);
  light_ms_ = milliseconds_since(light_begin);

  // Nothing would change: the picture is right, and nobody asked for anything else.
  const bool right =
      std::equal(target.begin(), target.end(), relighter_->tracker().shown().begin());
  const bool asked =
      fresh_ || !(settings == last_) || stepping_ || next_start_ != FrameStart::advance;
  if (converged_ && right && !asked) {
    move_on(settings, ticks);
    return false;
  }

  LightingOptions lighting;
  lighting.method = settings.method;
  lighting.wavelets = settings.wavelets;
  relighter_->set_options(lighting, settings.weight);
  relighter_->set_budget(budget(settings));
  relighter_->compare_with_reference(settings.compare);
  set_view(settings);
  const int number = static_cast<int>(frames_);
  metrics_ = relighter_->relight(target, next_start_, number);
  // Whatever ended the update, a replay ends it at the same number.
  const int allowed = std::max(1, metrics_.wavelets);
  if (recording_now_) {
    std::optional<Camera> camera;
    if (scene_->transport.info().mesh) camera = relighter_->view().camera;
    recording_.frames.push_back(
        {light_, settings.method, allowed, settings.weight, next_start_, metrics_.course, camera});
  }
  if (!exposure_) {
    exposure_ =
        auto_exposure_ev(next_start_ == FrameStart::exact
                             ? relighter_->picture()
                             : relight_picture_once(scene_->transport, target,
                                                    relighter_->view().camera, any_relighter()));
  }
  allowed_ = allowed;
  next_start_ = FrameStart::advance;
  converged_ = metrics_.lighting_error == 0 && relighter_->settled();
  fresh_ = false;
  last_ = settings;
  ++frames_;
  fill(settings, out);
  move_on(settings, ticks);
  return true;
}

void Session::fill(const ViewSettings& settings, ViewFrame& out) {
  out.number = frames_;
  out.scene = scene_;
  out.from = lights_[static_cast<std::size_t>(from_)];
  out.to = to_ >= 0 ? lights_[static_cast<std::size_t>(to_)] : nullptr;
  out.light = light_;
  out.exact_exposure_ev = *exposure_;
  out.picture = relighter_->picture();
  draw_clusters(settings);
  if (!clusters_.pixels.empty()) out.picture = clusters_;
  out.compared = relighter_->reference() != nullptr;
  if (out.compared) out.reference = *relighter_->reference();
  const SceneView view = relighter_->view();
  out.camera = view.camera;
  out.coverage.assign(view.coverage.begin(), view.coverage.end());
  out.view_number = view_number_;
  out.metrics = metrics_;
  out.light_ms = light_ms_;
  out.budget = allowed_;
  const HaarLayout& layout = relighter_->tracker().layout();
  out.band_count = layout.band_count();
  out.band_updates.fill(0);
  for (const WaveletDelta& delta : relighter_->update().deltas) {
    ++out.band_updates[static_cast<std::size_t>(layout.band_of(delta.index))];
  }
  out.resets = relighter_->update().reset;
  out.converged = converged_;
  out.position = position_;
  out.recording = recording_now_;
  out.recorded = static_cast<int>(recording_.frames.size());
  out.lighting_filled = settings.show_lighting;
  if (settings.show_lighting) fill_lighting(out);
}

// In colours that the display's exposure leaves as they are.
void Session::draw_clusters(const ViewSettings& settings) {
  clusters_.pixels.clear();
  if (!settings.clusters || scene_->transport.kind() != TransportKind::clusters) return;
  if (!colours_) colours_.emplace(scene_->transport);
  clusters_ = colours_->picture(relighter_->view().camera);
  const auto bright = static_cast<float>(std::exp2(-*exposure_));
  for (Rgb& pixel : clusters_.pixels) pixel *= bright;
}

void Session::fill_lighting(ViewFrame& out) {
  const HaarLayout& layout = relighter_->tracker().layout();
  out.target = rig_->cubemap(light_);
  if (out.shown.n != layout.face_size()) out.shown = Cubemap(layout.face_size());
  haar_inverse(layout, relighter_->tracker().shown(), out.shown.texels);
  count_touched(layout, relighter_->update(), out.touched);
}

Image Session::picture_with_background() const {
  Image picture = clusters_.pixels.empty() ? relighter_->picture() : clusters_;
  std::vector<Environment> environments;
  for (const auto& light : lights_) environments.push_back(light->environment);
  composite_light_background(relighter_->view(), light_, environments, picture);
  return picture;
}

}  // namespace haarlight::viewer
