// What the benchmarks run on: one transport, one environment, one scene, made before any case runs.

#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "core/rgb.h"
#include "precompute/scene.h"
#include "prt/transport.h"

namespace haarlight::bench {

struct Inputs {
  std::optional<Transport> transport;
  std::optional<Scene> scene;
  std::vector<std::vector<Rgb>> targets;  ///< lighting of frames 0 to 99 of `rotate`
};

/// Filled by main before the cases run.
Inputs& inputs();

void register_memory();
void register_decide();
void register_relight();
void register_rays();

}  // namespace haarlight::bench
