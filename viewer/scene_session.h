// A scene that moves, played and taken hold of, without a window.

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "caching/animated_scene.h"
#include "caching/animation_method.h"
#include "caching/frame_tracer.h"
#include "caching/instant_method.h"
#include "core/image.h"
#include "viewer/settings.h"

namespace haarlight::viewer {

/// How frames are drawn; see docs/caching.md.
enum class SceneMethod { path, irc, trc, igi, ic, tic };
inline constexpr int kSceneMethods = 6;

struct SceneSettings {
  int width = 600, height = 400;  ///< pixels
  SceneMethod method = SceneMethod::path;
  int samples = 1;            ///< path: paths a pixel in one picture, >= 1
  int first = 0;              ///< frame that it begins with
  std::filesystem::path env;  ///< a picture behind everything in place of the scene's; empty: none
  /// path, igi, ic, tic: where fewer pictures come a second while something moves they are half or
  /// a quarter as wide and high, until all rests; 0: never.
  double least_rate = 0;
  bool show_life = false;  ///< irc, trc, ic, tic: records coloured by their life
};

/// Plays an animated scene. What is still is drawn better and better by `path`, and once by the
/// others; by virtual lights each frame as it stands, so that a hand may move anything. Not for two
/// threads at once.
class SceneSession {
 public:
  /// Throws as AnimatedScene and load_environment(), and Error{missing} without a camera.
  SceneSession(const std::filesystem::path& file, const SceneSettings& settings);
  ~SceneSession();

  void play(bool on) { playing_ = on; }
  bool playing() const { return playing_; }
  /// So many frames on, or back, and stops. After the last frame comes the first.
  void step(int frames);
  void set_method(SceneMethod method);
  /// Whether life() is drawn, too.
  void show_life(bool on);
  bool shows_life() const { return settings_.show_life; }
  SceneMethod method() const { return settings_.method; }
  /// Radians about +Y and up, and halvings of the distance, all about what is in the middle of the
  /// first picture, on top of the file's camera.
  void orbit(double turn, double rise, double closer);

  /// What a pointer has taken hold of: a lamp or a body, with all that hangs on it.
  struct Grab {
    std::uint32_t node = 0;
    bool lamp = false;
    Vec3 point;   ///< world
    Vec3 before;  ///< how far it had been carried
  };
  /// At a place in the picture, pixels: a lamp within ten of them, or the body seen there unless
  /// it is all around the camera, as rooms are. Nothing before the first picture.
  std::optional<Grab> grab(double x, double y) const;
  /// Carries it so that its point is seen at a place in the picture, as far off as it was.
  void drag(const Grab& grab, double x, double y);

  /// The next picture: the next frame if it plays, or a better one of this. False, with the picture
  /// as it was, if there is nothing to draw: it rests and is as good as it gets. Throws as
  /// AnimationMethod::frame().
  bool advance();

  const Image& picture() const { return picture_; }  ///< radiance
  /// Red where records are new, or end now, green where they last; display-referred. Empty unless
  /// asked for and drawn by a method that has records.
  const Image& life() const { return life_; }
  int coarseness() const { return coarse_; }  ///< 1, or 2 or 4: how many times fewer pixels across
  int frame() const { return frame_; }
  int frames() const { return frames_; }
  int samples() const { return samples_; }  ///< paths a pixel in picture()
  std::size_t triangles() const { return scene_.triangle_count(); }
  /// Where lamps are seen, pixels; those before the camera.
  std::vector<std::array<double, 2>> lamps_seen() const;

  static constexpr int kMostSamples = 4096;
  static constexpr int kCoarsest = 4;

 private:
  void look();
  void draw_paths();
  void draw_virtual_lights();
  void draw_records();
  void take(FramePicture drawn);
  void choose_size(bool moves);
  int width() const { return settings_.width / coarse_; }
  int height() const { return settings_.height / coarse_; }
  bool is_instant() const { return settings_.method >= SceneMethod::igi; }
  const FrameTracer& tracer() const;
  std::optional<std::array<double, 2>> pixel_of(const Vec3& world) const;

  AnimatedScene scene_;
  SceneSettings settings_;
  int frame_ = 0, frames_ = 1;
  bool playing_ = false, begun_ = false;
  bool changed_ = true;         // the picture is of something else
  ViewSettings view_;           // of these, where it is seen from
  std::optional<Vec3> middle_;  // what the camera turns about
  Camera camera_;
  std::unique_ptr<AnimatedFrame> now_;
  mutable std::unique_ptr<FrameTracer> tracer_;  // of now_, once somebody asks
  std::unique_ptr<AnimationMethod> method_;
  std::unique_ptr<InstantMethod> instant_;
  int drawn_ = -1;        // the last frame that method_ drew
  bool touched_ = false;  // since then something moved that no key says
  int coarse_ = 1;        // of the last picture
  double seconds_ = 0;    // that it took
  Image picture_, life_;
  std::vector<RgbD> sum_;
  int samples_ = 0;
};

}  // namespace haarlight::viewer
