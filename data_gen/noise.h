// Smooth noise in space: what makes walls, clouds and floors less than perfectly even.

#pragma once

#include "core/vec.h"

namespace haarlight::data_gen {

/// Value noise: a fixed random number in [-1, 1] at every integer point, joined by smoothstep.
double value_noise(const Vec3& point);

/// `octaves` layers of value noise, each twice as fine and half as strong; within [-2, 2].
double fractal_noise(const Vec3& point, int octaves);

}  // namespace haarlight::data_gen
