// Draws a frame's picture with the light behind it, tonemapped, by OpenGL.

#pragma once

#include <cstdint>
#include <memory>

#include "prt/tonemap.h"
#include "viewer/texture.h"
#include "viewer/view_frame.h"

namespace haarlight::viewer {

/// A rectangle of the framebuffer in pixels, from the top left.
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

struct PaintOptions {
  double exposure_ev = 0;
  TonemapCurve curve = TonemapCurve::filmic;
  bool false_colour = false;
  bool reference = false;  ///< the exact picture instead, right of `split`
  double split = 0;        ///< [0, 1] of the picture's width
};

/// Needs a current context of OpenGL 3.3 for its whole life.
class PicturePainter {
 public:
  PicturePainter();
  ~PicturePainter();
  PicturePainter(const PicturePainter&) = delete;
  PicturePainter& operator=(const PicturePainter&) = delete;

  /// Takes a frame's pictures to the graphics card; only what changed since the last one.
  void upload(const ViewFrame& frame);
  /// Draws what was uploaded last into `where` of the current framebuffer, `height` pixels high.
  void draw(const PixelRect& where, int height, const PaintOptions& options);

 private:
  struct Uniforms;
  unsigned program_ = 0, vertices_ = 0;
  std::unique_ptr<Uniforms> at_;
  Texture picture_, reference_, coverage_, from_, to_, ramp_;
  bool compared_ = false;
  std::uint64_t view_ = 0;
  std::shared_ptr<const OpenLight> light_from_, light_to_;
  LightState light_;
  Camera camera_;
};

}  // namespace haarlight::viewer
