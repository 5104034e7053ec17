// A shiny ring on a matt ground.

#include <cmath>
#include <vector>

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

// A rectangle with round corners, (radius, height), walked with the outside on the right hand from
// the middle of its lower side; the first point comes again at the end. Every straight side ends in
// a short piece, which keeps the tilt of the corners' smooth normals off the rest of it.
std::vector<ProfilePoint> band_profile(double inner, double outer, double height, double round) {
  constexpr int kCorner = 8;
  const double short_piece = 0.15 * round;
  std::vector<ProfilePoint> profile{{(inner + outer) / 2, 0}};
  const auto corner = [&](double x, double y, double from) {
    const auto at = [&](double angle) {
      return ProfilePoint{x + round * std::cos(angle), y + round * std::sin(angle)};
    };
    const ProfilePoint first = at(from), last = at(from + kPi / 2);
    profile.push_back(
        {first.radius + short_piece * std::sin(from), first.height - short_piece * std::cos(from)});
    for (int i = 0; i <= kCorner; ++i) profile.push_back(at(from + kPi / 2 * i / kCorner));
    profile.push_back(
        {last.radius - short_piece * std::cos(from), last.height - short_piece * std::sin(from)});
  };
  corner(outer - round, round, -kPi / 2);
  corner(outer - round, height - round, 0);
  corner(inner + round, height - round, kPi / 2);
  corner(inner + round, round, kPi);
  profile.push_back(profile.front());
  return profile;
}

}  // namespace

Scene make_ring(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto ground = builder.add_material("ground", {0.62f, 0.60f, 0.57f});
  Material metal;
  metal.name = "gold";
  metal.model = SurfaceModel::metallic_roughness;
  metal.albedo = {1.00f, 0.77f, 0.34f};
  metal.metallic = 1;
  metal.roughness = 0;
  const auto gold = builder.add_material(metal);
  builder.add_ground(ground, 6);

  const double height = random.between(0.36, 0.40);
  const std::vector<ProfilePoint> profile = band_profile(0.80, 0.92, height, 0.035);
  const int rows = static_cast<int>(profile.size()) - 1;
  builder.add_grid(
      gold, 160, rows,
      [&](double s, double t) {
        const ProfilePoint& p = profile[static_cast<std::size_t>(std::lround(t * rows))];
        const double around = 2 * kPi * s;
        // A hair above the ground, or both would lie in one plane.
        return Vec3{p.radius * std::sin(around), p.height + 1e-3, p.radius * std::cos(around)};
      },
      true);
  return builder.finish(look_at({0, 2.9, 3.0}, {0, 0.08, 0}, 0.6, 512, 512));
}

}  // namespace haarlight::data_gen
