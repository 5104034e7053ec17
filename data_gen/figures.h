// Figures to stand about in scenes: a bunny and a statue, each one closed surface.

#pragma once

#include "precompute/scene.h"

namespace haarlight::data_gen {

/// A sitting rabbit, 0.7 m long and high, on y = 0, looking along +X. `cells`: see isosurface().
Scene make_bunny(int cells);
/// A draped figure without arms on a round foot, 1.2 m high, on y = 0, looking along +Z.
Scene make_statue(int cells);
/// Any scene as a figure: `height` high, its middle over the origin, on y = 0, one material.
Scene as_figure(Scene scene, double height);

}  // namespace haarlight::data_gen
