// Embree against brute force; no self-shadowing; no leaks; no dependence on scale.

#include "precompute/visibility.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "core/error.h"
#include "tests/precompute/shapes.h"
#include "tests/reference/ray_triangle.h"

namespace haarlight {
namespace {

struct Packet {
  alignas(32) float x[8], y[8], z[8];
  Packet(std::mt19937& random) {
    for (int i = 0; i < 8; ++i) set(i, shapes::random_direction(random));
  }
  void set(int i, const Vec3& d) {
    x[i] = static_cast<float>(d.x), y[i] = static_cast<float>(d.y), z[i] = static_cast<float>(d.z);
  }
  Vec3 get(int i) const {
    return {static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])};
  }
};

std::array<float, 3> to_float(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
Vec3 to_vec(const std::array<float, 3>& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

TEST(Visibility, AgreesWithBruteForce) {
  std::mt19937 random(1);
  Scene scene = shapes::empty_scene();
  shapes::add_random_triangles(scene, 150, 0.5, random);
  const Visibility visibility(scene);
  std::uniform_real_distribution<double> place(-1, 1);
  int blocked = 0, compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto origin = to_float({place(random), place(random), place(random)});
    const Packet packet(random);
    const unsigned lanes = static_cast<unsigned>(random()) & 0xffu;
    const unsigned result = visibility.occluded8(origin, packet.x, packet.y, packet.z, lanes);
    EXPECT_EQ(result & ~lanes, 0u);
    for (int lane = 0; lane < 8; ++lane) {
      const auto expected = reference::trace(visibility, to_vec(origin), packet.get(lane));
      if (!(lanes >> lane & 1u) || expected.margin < 1e-5) continue;
      ++compared;
      blocked += expected.blocked;
      EXPECT_EQ((result >> lane & 1u) != 0, expected.blocked) << "ray " << i << " lane " << lane;
      const auto hit = visibility.first_hit(to_vec(origin), packet.get(lane));
      ASSERT_EQ(hit.has_value(), expected.blocked);
      // Distances up to 4 in float, slant up to 1 / 1e-5 excluded by the margin being mild here.
      if (hit) {
        EXPECT_NEAR(hit->distance, expected.nearest, 1e-4);
      }
    }
  }
  EXPECT_GT(compared, 7000);  // half of 16,000 lanes, few of them near a border
  EXPECT_GT(blocked, compared / 5);
  EXPECT_LT(blocked, compared * 4 / 5);
}

// Rays that leave a convex body never meet it again: 0 in a million, near and far from the origin,
// with triangles of all sizes.
TEST(Visibility, EightRaysMeetWhatOneMeets) {
  // Through both parts of a scene in turn, with lanes that are none, of three kinds of material.
  std::mt19937 random(9);
  Scene scene = shapes::empty_scene();
  scene.material.resize(3);
  scene.material[1].model = SurfaceModel::glass;
  scene.material[2].model = SurfaceModel::metallic_roughness;
  for (int i = 0; i < 60; ++i) {
    const Vec3 p = shapes::random_direction(random) * (0.2 * (i % 5));
    shapes::add_quad(scene, p, shapes::random_direction(random) * 0.4,
                     shapes::random_direction(random) * 0.4, static_cast<std::uint32_t>(i % 3));
  }
  const Visibility::LocalFrame frame = Visibility::local_frame(scene);
  std::vector<std::uint32_t> even, odd;
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) (t % 2 == 0 ? even : odd).push_back(t);
  const Visibility whole(scene), first(scene, frame, even), second(scene, frame, odd);
  int found = 0, missed = 0, differ = 0;
  for (int n = 0; n < 2000; ++n) {
    Visibility::Rays8 rays;
    Visibility::Hits8 hits;
    rays.lanes = static_cast<unsigned>(random()) & 255u;
    std::array<Vec3, 8> from, way;
    for (std::size_t i = 0; i < 8; ++i) {
      from[i] = shapes::random_direction(random) * 0.9;
      way[i] = normalize(shapes::random_direction(random) * 0.5 - from[i]);
      rays.set(i, to_float(from[i]), way[i], std::numeric_limits<double>::infinity());
    }
    for (const Visibility* part : {&first, &second}) part->first_hits8(rays, hits, n % 2 == 0);
    ASSERT_EQ(hits.found & ~rays.lanes, 0u);
    for (std::size_t i = 0; i < 8; ++i) {
      if (!(rays.lanes >> i & 1u)) continue;
      const auto one = whole.first_hit(to_vec(to_float(from[i])), way[i]);
      const bool meets = (hits.found >> i & 1u) != 0;
      ++(meets ? found : missed);
      if (one.has_value() != meets) {
        ++differ;  // grazes an edge
        continue;
      }
      if (!one) continue;
      const Visibility::Hit eight = hits.hit(i, rays);
      differ += eight.triangle != one->triangle;
      if (eight.triangle != one->triangle) continue;
      // Floats of coordinates below 2, in another order.
      EXPECT_NEAR(eight.distance, one->distance, 1e-4);
      EXPECT_NEAR(eight.b1, one->b1, 1e-3);
      EXPECT_NEAR(eight.b2, one->b2, 1e-3);
    }
  }
  EXPECT_GT(found, 2000);
  EXPECT_GT(missed, 500);
  EXPECT_LT(differ, 8);
}

TEST(Visibility, ConvexBodiesDoNotShadowThemselves) {
  Scene sphere = shapes::empty_scene();
  shapes::add_sphere(sphere, {0.1, 0.2, 0.3}, 0.7, 6);
  Scene needle = shapes::empty_scene();
  shapes::add_box(needle, {0, 0, 0}, {1, 1e-3, 3e-3});
  std::mt19937 random(2);
  for (const Scene& scene : {sphere, shapes::moved(sphere, 1, {3e5, -1e5, 2e5}),
                             shapes::moved(sphere, 1e-4, {}), needle}) {
    const Visibility visibility(scene);
    std::uniform_real_distribution<double> unit(0, 1);
    std::int64_t rays = 0, blocked = 0;
    while (rays < 250000) {
      const auto t = static_cast<std::uint32_t>(random() % visibility.triangle_count());
      double b1 = unit(random), b2 = unit(random);
      if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
      const Vec3 a = visibility.corner(t, 0), b = visibility.corner(t, 1),
                 c = visibility.corner(t, 2);
      const Vec3 normal = normalize(cross(b - a, c - a));
      const auto origin =
          to_float(a * (1 - b1 - b2) + b * b1 + c * b2 + Visibility::kSurfaceOffset * normal);
      Packet packet(random);
      for (int lane = 0; lane < 8; ++lane) {
        Vec3 d = packet.get(lane);
        if (dot(d, normal) < 0) d = -d;
        if (lane % 2 == 0) d = normalize(d - 0.999 * dot(d, normal) * normal);  // grazing
        packet.set(lane, d);
      }
      blocked += std::popcount(visibility.occluded8(origin, packet.x, packet.y, packet.z, 0xff));
      rays += 8;
    }
    EXPECT_EQ(blocked, 0) << rays << " rays";
  }
}

// From inside a closed body every ray is blocked. Random rays hit an edge exactly with probability
// of about 1e-7 each, so none of 400,000 is expected to slip through, and none is allowed.
TEST(Visibility, ClosedBodiesDoNotLeak) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {}, 1, 5);
  std::mt19937 random(3);
  for (const Vec3& by : {Vec3{}, Vec3{148376, -148376, 98000}}) {
    const Scene there = shapes::moved(scene, 1, by);
    const Visibility visibility(there);
    std::uniform_real_distribution<double> place(-0.5, 0.5);
    for (int i = 0; i < 25000; ++i) {
      const Packet packet(random);
      const auto origin = to_float({place(random), place(random), place(random)});
      ASSERT_EQ(visibility.occluded8(origin, packet.x, packet.y, packet.z, 0xff), 0xffu);
    }
  }
}

// Rays aimed at the seams between triangles, the places where a careless intersector leaks.
TEST(Visibility, SeamsDoNotLeak) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0.1, 0.2, 0.3}, 1, 5);
  const Visibility visibility(scene);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> place(-0.5, 0.5), unit(0.01, 0.99);
  std::int64_t missed = 0;
  for (int i = 0; i < 50000; ++i) {
    const auto origin = to_float({place(random), place(random), place(random)});
    Packet packet(random);
    for (int lane = 0; lane < 8; ++lane) {
      const auto t = static_cast<std::uint32_t>(random() % visibility.triangle_count());
      const int c = static_cast<int>(random() % 3);
      const double along = unit(random);
      const Vec3 on_edge =
          visibility.corner(t, c) * along + visibility.corner(t, (c + 1) % 3) * (1 - along);
      packet.set(lane, normalize(on_edge - to_vec(origin)));
    }
    missed += 8 - std::popcount(visibility.occluded8(origin, packet.x, packet.y, packet.z, 0xff));
  }
  // The closed room's bound: 2e-5 of the rays.
  EXPECT_LE(missed, 8);
}

// A cloud of triangles of four kinds in turn: what each mask sees is what brute force sees in a
// scene of that class alone, hits carry the whole scene's numbers, corners are those of the scene.
TEST(Visibility, MasksSeeTheirClassOfSurfaces) {
  std::mt19937 random(11);
  Scene scene = shapes::empty_scene();
  shapes::add_random_triangles(scene, 160, 0.5, random);
  scene.material.resize(4);
  scene.material[1].model = SurfaceModel::mirror;
  scene.material[2].model = SurfaceModel::glass;
  scene.material[3].alpha_cutoff = 0.5f;  // no texture: no hole
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    scene.triangle[t].material = static_cast<std::uint32_t>(t % 4);
  }
  const auto is_specular = [&](std::uint32_t t) { return t % 4 == 1 || t % 4 == 2; };
  const Visibility all(scene);
  EXPECT_TRUE(all.has_specular());
  EXPECT_TRUE(all.has_holes());
  for (std::uint32_t t = 0; t < all.triangle_count(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const Vec3 there = all.to_local(scene.position[scene.triangle[t].vertex[std::size_t(c)]]);
      EXPECT_NEAR(length(all.corner(t, c) - there), 0, 1e-6);
    }
  }
  std::uniform_real_distribution<double> place(-1, 1);
  int hits = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto origin = to_float({place(random), place(random), place(random)});
    const Packet packet(random);
    for (const auto seen : {Visibility::kOpaque, Visibility::kSpecular, Visibility::kAll}) {
      const unsigned result = all.occluded8(origin, packet.x, packet.y, packet.z, 0xff, seen);
      for (int lane = 0; lane < 8; ++lane) {
        const auto expected =
            reference::trace(all, to_vec(origin), packet.get(lane), [&](std::uint32_t t) {
              return (is_specular(t) ? Visibility::kSpecular : Visibility::kOpaque) & seen;
            });
        if (expected.margin < 1e-5) continue;
        ASSERT_EQ((result >> lane & 1u) != 0, expected.blocked);
        ASSERT_EQ(all.occluded(origin, packet.get(lane), INFINITY, seen), expected.blocked);
        const auto hit = all.first_hit(to_vec(origin), packet.get(lane), seen);
        ASSERT_EQ(hit.has_value(), expected.blocked);
        if (!hit) continue;
        ++hits;
        EXPECT_EQ(hit->triangle, expected.triangle);
        EXPECT_NEAR(hit->distance, expected.nearest, 1e-4);
      }
    }
  }
  EXPECT_GT(hits, 5000);
}

TEST(Visibility, SegmentsAreBlockedOnlyBetweenTheirEnds) {
  std::mt19937 random(12);
  Scene scene = shapes::empty_scene();
  shapes::add_random_triangles(scene, 150, 0.5, random);
  const Visibility visibility(scene);
  EXPECT_FALSE(visibility.has_specular());
  EXPECT_FALSE(visibility.has_holes());
  std::uniform_real_distribution<double> place(-1, 1), share(0.2, 3);
  int blocked = 0, compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto origin = to_float({place(random), place(random), place(random)});
    Packet packet(random);
    for (int lane = 0; lane < 8; ++lane) packet.set(lane, share(random) * packet.get(lane));
    const unsigned lanes = static_cast<unsigned>(random()) & 0xffu;
    const unsigned result =
        visibility.occluded8_segments(origin, packet.x, packet.y, packet.z, lanes);
    EXPECT_EQ(result & ~lanes, 0u);
    for (int lane = 0; lane < 8; ++lane) {
      const Vec3 segment = packet.get(lane);
      const double size = length(segment);
      const auto expected = reference::trace(visibility, to_vec(origin), segment * (1 / size));
      if (!(lanes >> lane & 1u) || expected.margin < 1e-5) continue;
      if (std::abs(expected.nearest - size) < 1e-4) continue;
      ++compared;
      const bool is_blocked = expected.nearest < size;
      blocked += is_blocked;
      ASSERT_EQ((result >> lane & 1u) != 0, is_blocked);
      ASSERT_EQ(visibility.occluded(origin, segment * (1 / size), size), is_blocked);
    }
  }
  EXPECT_GT(compared, 7000);
  EXPECT_GT(blocked, compared / 5);
  EXPECT_LT(blocked, compared * 4 / 5);
  alignas(32) const float nothing[8] = {};
  EXPECT_EQ(visibility.occluded8_segments({0, 0, 0}, nothing, nothing, nothing, 0xff), 0u);
}

// A sheet of a checkerboard of holes, in each class: rays pass where alpha is below the cutoff, and
// meet the floor below. Bilinear alpha crosses the cutoff half way between unlike pixels.
TEST(Visibility, RaysPassThroughHoles) {
  for (const SurfaceModel model : {SurfaceModel::phong, SurfaceModel::mirror}) {
    Scene scene = shapes::empty_scene();
    scene.material.resize(3);
    shapes::add_quad(scene, {-1, -1, -1}, {0, 0, 2}, {2, 0, 0});  // floor
    shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 1);
    scene.material[1].model = model;
    scene.material[1].alpha_cutoff = 0.5f;
    scene.material[1].texture = 0;
    // add_quad runs along z first: u follows z, v follows x.
    scene.uv[4] = {0, 0}, scene.uv[5] = {1, 0}, scene.uv[6] = {1, 1}, scene.uv[7] = {0, 1};
    scene.texture.emplace_back(4, 4);
    scene.alpha.resize(1);
    for (int i = 0; i < 16; ++i) scene.alpha[0].push_back((i + i / 4) % 2 == 0 ? 1.0f : 0.0f);
    const Visibility visibility(scene);
    EXPECT_TRUE(visibility.has_holes());
    EXPECT_EQ(visibility.has_specular(), model == SurfaceModel::mirror);
    int holes = 0;
    for (int row = 0; row < 4; ++row) {  // from the top: v from 1 down
      for (int column = 0; column < 4; ++column) {
        // Off the diagonal of the quad, where either triangle may answer.
        const double u = (column + 0.45) / 4, v = 1 - (row + 0.52) / 4;
        const Vec3 above = visibility.to_local({2 * v - 1, 0.5, 2 * u - 1});
        const bool hole = (row + column) % 2 != 0;
        holes += hole;
        const auto hit = visibility.first_hit(above, {0, -1, 0});
        ASSERT_TRUE(hit);
        EXPECT_NEAR(hit->distance, hole ? 1.5 : 0.5, 1e-5) << row << " " << column;
        EXPECT_EQ(hit->triangle / 2, hole ? 0u : 1u);
        EXPECT_EQ(visibility.occluded(to_float(above), {0, -1, 0}, 1.0), !hole);
        alignas(32) float x[8] = {}, y[8], z[8] = {};
        for (float& f : y) f = -1;
        EXPECT_EQ(visibility.occluded8_segments(to_float(above), x, y, z, 0x5a), hole ? 0u : 0x5au);
        EXPECT_EQ(visibility.occluded8(to_float(above), x, y, z, 0x5a), 0x5au);
      }
    }
    EXPECT_EQ(holes, 8);
    scene.material[1].alpha_cutoff = 2;  // whatever its alpha: all hole
    const Visibility none(scene);
    EXPECT_NEAR(none.first_hit(none.to_local({0.1, 0.5, 0.2}), {0, -1, 0})->distance, 1.5, 1e-5);
  }
}

// A closed room whose walls take turns in all four kinds of geometry leaks no more than one of a
// single kind: Embree's robust mode works triangle by triangle.
TEST(Visibility, SeamsBetweenKindsDoNotLeak) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0.1, 0.2, 0.3}, 1, 4);
  scene.material.resize(4);
  scene.material[1].model = SurfaceModel::mirror;
  scene.material[2].alpha_cutoff = 0.5f;
  scene.material[3] = scene.material[1];
  scene.material[3].alpha_cutoff = 0.5f;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    scene.triangle[t].material = static_cast<std::uint32_t>(t % 4);
  }
  const Visibility visibility(scene);
  std::mt19937 random(13);
  std::uniform_real_distribution<double> place(-0.5, 0.5), unit(0.01, 0.99);
  std::int64_t missed = 0;
  for (int i = 0; i < 50000; ++i) {
    const auto origin = to_float({place(random), place(random), place(random)});
    Packet packet(random);
    for (int lane = 0; lane < 8; lane += 2) {  // the others go anywhere
      const auto t = static_cast<std::uint32_t>(random() % visibility.triangle_count());
      const int c = static_cast<int>(random() % 3);
      const double along = unit(random);
      const Vec3 on_edge =
          visibility.corner(t, c) * along + visibility.corner(t, (c + 1) % 3) * (1 - along);
      packet.set(lane, normalize(on_edge - to_vec(origin)));
    }
    missed += 8 - std::popcount(visibility.occluded8(origin, packet.x, packet.y, packet.z, 0xff));
  }
  EXPECT_LE(missed, 8);  // the closed room's bound: 2e-5 of the rays
}

TEST(Visibility, LocalFrameIgnoresPowerOfTwoScale) {
  std::mt19937 random(4);
  Scene scene = shapes::empty_scene();
  shapes::add_random_triangles(scene, 20, 0.7, random);
  const Visibility plain(scene);
  for (const int exponent : {-40, -20, 20, 40}) {
    const double scale = std::ldexp(1.0, exponent);
    const Visibility scaled(shapes::moved(scene, scale, {}));
    for (std::uint32_t t = 0; t < plain.triangle_count(); ++t) {
      for (int c = 0; c < 3; ++c) EXPECT_EQ(plain.corner(t, c), scaled.corner(t, c));
    }
    const Vec3 p{0.3, -0.7, 1.9};
    EXPECT_EQ(plain.to_local(p), scaled.to_local(scale * p));
  }
}

TEST(Visibility, RefusesScenesWithoutTrianglesOrExtent) {
  Scene scene = shapes::empty_scene();
  try {
    const Visibility visibility(scene);
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::missing);
  }
  shapes::add_vertex(scene, {1, 1, 1}, {0, 1, 0});
  scene.triangle.push_back({{0, 0, 0}, 0});
  try {
    const Visibility visibility(scene);
    FAIL() << "expected an error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::format);
  }
}

}  // namespace
}  // namespace haarlight
