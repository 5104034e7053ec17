// The last frames' numbers, and their plots.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "viewer/view_frame.h"

namespace haarlight::viewer {

/// A ring of the newest frames.
class History {
 public:
  static constexpr std::size_t kFrames = 240;

  void add(const ViewFrame& frame);
  void clear() { count_ = 0; }

  /// Draws at the cursor of the current ImGui window, side by side over its width: errors, times,
  /// the bands frame by frame (Overbeck 2006, Figure 9) and updates a band (Figure 4).
  void draw(float width, float height, float scale) const;

 private:
  struct Entry {
    float lighting_error = 0, image_error = -1;  // -1: not compared
    float light_ms = 0, update_ms = 0, apply_ms = 0, finish_ms = 0;
    std::uint16_t resets = 0;
    std::uint16_t touched = 0;  // bands with an update
    std::array<int, HaarLayout::kMaxBands> updates{};
  };
  const Entry& at(std::size_t back) const;  // 0: the newest
  std::size_t size() const { return count_ < kFrames ? count_ : kFrames; }

  void draw_errors(float x, float y, float width, float height, float scale) const;
  void draw_times(float x, float y, float width, float height, float scale) const;
  void draw_bands(float x, float y, float width, float height, float scale) const;
  void draw_updates(float x, float y, float width, float height, float scale) const;

  std::array<Entry, kFrames> entries_{};
  std::size_t count_ = 0;
  int bands_ = 0;
};

}  // namespace haarlight::viewer
