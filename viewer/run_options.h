// What the program haarlight-view was asked to do.

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "prt/tonemap.h"
#include "viewer/settings.h"

namespace haarlight::viewer {

enum class CompareView {
  none,   ///< the picture alone
  split,  ///< the picture left of a line, the exact one right of it
  side,   ///< both, beside each other
};

struct RunOptions {
  std::filesystem::path transport, env, env_to;
  ViewSettings settings;
  std::optional<double> exposure_ev;  ///< none: chosen from the first exact picture
  TonemapCurve curve = TonemapCurve::filmic;
  bool false_colour = false;
  CompareView compare = CompareView::none;

  int frames = 0;  ///< end after so many; 0: when the person closes the window
  std::filesystem::path screenshot, exr, record, metrics;
  bool timings = false;

  // Of the window alone.
  int width = 1280, height = 800;
  std::filesystem::path script;
  bool remember = true;  ///< read and write the preferences
};

}  // namespace haarlight::viewer
