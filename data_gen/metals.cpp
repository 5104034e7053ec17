// Balls of metal and plastic, smooth to rough.

#include <array>
#include <string>

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {

Scene make_metals(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto ground = builder.add_material("ground", {0.42f, 0.42f, 0.40f});
  builder.add_ground(ground, 6);
  struct Kind {
    const char* name;
    Rgb color;
    float metallic;
  };
  constexpr std::array kKinds{Kind{"white plastic", {0.80f, 0.80f, 0.80f}, 0},
                              Kind{"copper", {0.955f, 0.638f, 0.538f}, 1},
                              Kind{"gold", {1.000f, 0.766f, 0.336f}, 1}};
  constexpr std::array kRoughness{0.05f, 0.2f, 0.4f, 0.7f, 1.0f};
  const double radius = random.between(0.29, 0.31);
  for (std::size_t k = 0; k < kKinds.size(); ++k) {
    for (std::size_t i = 0; i < kRoughness.size(); ++i) {
      Material m;
      m.name = std::string(kKinds[k].name) + " " + std::to_string(i + 1);
      m.model = SurfaceModel::metallic_roughness;
      m.albedo = kKinds[k].color;
      m.metallic = kKinds[k].metallic;
      m.roughness = kRoughness[i];
      const Vec3 center{(static_cast<double>(i) - 2) * 0.72, radius,
                        (1 - static_cast<double>(k)) * 0.72};
      builder.add_ellipsoid(builder.add_material(m), center, {radius, radius, radius}, 40);
    }
  }
  return builder.finish(look_at({0, 2.3, 4.6}, {0, 0.2, 0}, 0.62, 512, 384));
}

}  // namespace haarlight::data_gen
