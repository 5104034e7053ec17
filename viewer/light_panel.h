// The light as small maps: lamps to place by dragging, and the shown lighting beside the exact one.

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "viewer/lighting_picture.h"
#include "viewer/settings.h"
#include "viewer/texture.h"
#include "viewer/view_frame.h"

namespace haarlight::viewer {

/// Lengths in units of the pointer.
struct LightPanelSize {
  float width;       ///< to draw in
  float map_height;  ///< of the map with the lamps
  float full_width;  ///< `width` where there is no scroll bar
};

/// Needs a current context of OpenGL when it draws.
class LightPanel {
 public:
  /// Draws at the cursor of the current ImGui window. Takes lamps along in `settings` as they are
  /// dragged. `mark` names what was drawn last.
  void draw(const ViewFrame& frame, bool new_frame, double exposure_ev, const LightPanelSize& size,
            float scale, ViewSettings& settings, const std::function<void(const char*)>& mark);

 private:
  void draw_map(float width, float height, float scale, ViewSettings& settings);
  void draw_lamps(ViewSettings& settings, float scale,
                  const std::function<void(const char*)>& mark);

  Unfolding unfolding_ = Unfolding::latlong;
  bool coverage_ = true;
  std::optional<UnfoldedCube> unfolded_, flat_;
  Texture target_, shown_, map_;
  std::vector<std::uint8_t> rgba_;
  int selected_ = -1;
  enum class Drag { none, move, resize } drag_ = Drag::none;
  double drawn_ev_ = 1e9;
  Unfolding drawn_ = Unfolding::cross;
  bool drawn_coverage_ = false;
};

}  // namespace haarlight::viewer
