// A relighting session without a window: settings and actions in, frames out.

#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "cpca/cluster_colours.h"
#include "prt/frame_relighter.h"
#include "prt/light_rig.h"
#include "prt/motion_file.h"
#include "prt/transport_mesh.h"
#include "viewer/settings.h"
#include "viewer/view_frame.h"

namespace haarlight::viewer {

/// Holds a transport, environments and what is shown of them. After every frame
/// picture == T * shown. Not for two threads at once.
class Session {
 public:
  Session();
  ~Session();

  /// Does what an action says. Throws Error, and then goes on as if it had not been asked.
  void act(const ViewAction& action);

  /// Whether advance() has something to relight with.
  bool ready() const { return scene_ && from_ >= 0; }

  /// Relights one frame into `out`. The motion then moves on by `ticks` sixtieths of a second if it
  /// is playing. Returns false, and leaves `out` alone, if the frame would be that of before: light
  /// at rest, converged, nothing new asked. Does nothing unless ready(). Throws Error for settings
  /// out of range. No heap use once warm, but for the frames of a recording.
  bool advance(const ViewSettings& settings, double ticks, ViewFrame& out);

  /// Whether every further frame would be that of before until something is asked for.
  bool resting(const ViewSettings& settings) const;

  const LightState& light() const { return light_; }
  /// What is relit with; null before a transport is open.
  const FrameRelighter* relighter() const { return relighter_ ? &*relighter_ : nullptr; }
  /// Null before one is open.
  const Transport* transport() const { return scene_ ? &scene_->transport : nullptr; }
  const MotionRecording& recording() const { return recording_; }

  /// The last frame's radiance with the light behind it. Requires a frame.
  Image picture_with_background() const;

 private:
  void open_transport(const std::filesystem::path& file);
  void open_environment(const OpenEnvironment& open);
  void start_recording();
  void set_light(const ViewSettings& settings);
  void set_view(const ViewSettings& settings);
  FrameBudget budget(const ViewSettings& settings) const;
  void move_on(const ViewSettings& settings, double ticks);
  void fill(const ViewSettings& settings, ViewFrame& out);
  void fill_lighting(ViewFrame& out);
  void draw_clusters(const ViewSettings& settings);

  std::shared_ptr<const OpenScene> scene_;
  std::vector<std::shared_ptr<const OpenLight>> lights_;  // as the rig numbers them
  std::optional<LightRig> rig_;
  std::optional<FrameRelighter> relighter_;
  std::optional<ClusterColours> colours_;  // once asked for
  Image clusters_;                         // the last frame in them, if it was asked for
  std::optional<double> exposure_;
  BoundingSphere middle_;  // of a mesh
  std::uint64_t view_number_ = 0;
  std::optional<Camera> camera_;  // that a mesh is drawn from

  int from_ = -1, to_ = -1;
  double blend_ = 0, fade_ = 0;  // fade_: of blend_ in a tick
  double position_ = 0;
  int rested_ = 0;  // ticks that a looping motion has been at its end
  LightState light_;
  FrameStart next_start_ = FrameStart::exact;
  bool stepping_ = false, recording_now_ = false;
  bool fresh_ = true;  // something was asked for that the next frame must show
  bool converged_ = false;
  ViewSettings last_;
  std::uint64_t frames_ = 0;
  FrameMetrics metrics_;
  double light_ms_ = 0;
  int allowed_ = 0;  // wavelets of the last frame
  MotionRecording recording_;
};

/// Where a mesh is seen from: `file` is its transport's camera, `middle` what it turns about.
Camera orbit_camera(const Camera& file, const BoundingSphere& middle, const ViewSettings& settings);

/// Lat-long picture of an environment as it arrives, `height` high.
Image latlong_preview(const Environment& environment, int height);

}  // namespace haarlight::viewer
