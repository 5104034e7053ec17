// What the benchmarks run on: one transport, one environment, scenes, made before any case runs.

#pragma once

#include <benchmark/benchmark.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/rgb.h"
#include "precompute/scene.h"
#include "prt/row_sums.h"
#include "prt/transport.h"

namespace haarlight::bench {

struct Inputs {
  std::optional<Transport> transport;
  std::optional<Scene> scene;
  std::vector<std::vector<Rgb>> targets;  ///< lighting of frames 0 to 99 of `rotate`
  std::string light_scene;                ///< of data_gen/, for full light transport
  int light_size = 0;                     ///< pixels along its square picture
  int light_face = 0;                     ///< texels along a face of its lighting
};

/// Filled by main before the cases run.
Inputs& inputs();

/// Whether `sums` are state.iterations() times those of `once`; the case is an error if not.
void expect_repeated(benchmark::State& state, const RowSums& sums, const RowSums& once);

void register_kernels();
void register_cpca_kernels();
void register_memory();
void register_decide();
void register_relight();
void register_accumulate();
void register_rays();
void register_full_light();

}  // namespace haarlight::bench
