// Furniture for rooms that move: each stands on y = 0 about the origin and faces +Z.

#pragma once

#include <cstdint>

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"

namespace haarlight::data_gen {

/// An axis-aligned box by two corners.
void add_block(MeshBuilder& builder, std::uint32_t material, const Vec3& low, const Vec3& high);
/// A box with round edges, as cushions and cases have them: a superellipsoid of exponent 2 /
/// `round` (1: an ellipsoid, towards 0: a box).
void add_cushion(MeshBuilder& builder, std::uint32_t material, const Vec3& center, const Vec3& half,
                 double round, int segments);

/// Textures, as base colours: boards along v, a wall paper, a woven rug.
Image board_picture(std::uint64_t seed);
Image paper_picture();
Image rug_picture();

/// Seat 0.45 m high, with a back and turned legs.
Scene make_chair();
/// On five castors with arms; seat 0.46 m high.
Scene make_office_chair();
/// 1.4 x 0.7 m, 0.74 m high, with a chest of drawers.
Scene make_desk();
/// A table 1.1 x 0.7 x 0.45 m with turned legs.
Scene make_low_table();
Scene make_sofa();
/// 1 m wide, 1.9 m high, 0.3 m deep, with books of many colours.
Scene make_bookshelf(std::uint64_t seed);
/// A screen on a foot, 0.55 m wide, with a picture on it; a keyboard before it.
Scene make_monitor();
/// A heap of `count` books.
Scene make_books(int count, std::uint64_t seed);
Scene make_mug();
Scene make_vase();
/// A bowl of fruit, 0.32 m wide.
Scene make_fruit_bowl();
/// Two curtains with folds, for an opening of that width and height, at z = 0.
Scene make_curtains(double width, double height);
/// The plant of make_plant() in its pot, without what is about it; 1.1 m high.
Scene make_potted_plant();

}  // namespace haarlight::data_gen
