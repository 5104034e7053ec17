// What scenes that move have in common: a box of a room, lamps, cameras, turns.

#pragma once

#include <cstddef>
#include <vector>

#include "data_gen/animated_writer.h"
#include "data_gen/mesh_builder.h"

namespace haarlight::data_gen {

constexpr double kAnimationSeconds = 16;  // 401 frames at 25 a second

/// The builder's surfaces without a camera.
Scene finished(MeshBuilder& builder);
Scene quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Six walls of a room of 2 x 2 x 2 m about (0, 1, 0), facing inwards, red on the left, green on
/// the right.
void add_box_room(AnimatedWriter& writer);
/// Looks into that room from its front wall.
void add_box_camera(AnimatedWriter& writer);
/// A point light, W/sr. Returns its node.
std::size_t add_lamp(AnimatedWriter& writer, const Vec3& place, double intensity);

/// A turn about a unit axis as glTF has it: x, y, z, w.
std::vector<double> turn(const Vec3& axis, double radians);

/// A body at a place, still. Returns its node.
std::size_t add_still(AnimatedWriter& writer, const char* name, std::size_t mesh,
                      const Vec3& place = {}, double radians = 0, double scale = 1);

}  // namespace haarlight::data_gen
