// The project's own scenes through their files and back by way of the importer.

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "data_gen/mesh_writer.h"
#include "data_gen/scenes.h"
#include "precompute/scene_import.h"
#include "tests/core/temporary_folder.h"

namespace haarlight::data_gen {
namespace {

void expect_color(const Rgb& found, const Rgb& wanted, float allowance, const std::string& what) {
  EXPECT_NEAR(found.r, wanted.r, allowance) << what;
  EXPECT_NEAR(found.g, wanted.g, allowance) << what;
  EXPECT_NEAR(found.b, wanted.b, allowance) << what;
}

const Material& named(const Scene& scene, const std::string& name) {
  for (const Material& m : scene.material) {
    if (m.name == name) return m;
  }
  ADD_FAILURE() << name << " is lost";
  return scene.material.front();
}

TEST(RoundTrip, GltfKeepsScenesAndMaterials) {
  const TemporaryFolder folder;
  for (const char* name :
       {"ring", "glass", "cornell", "cornell-dark", "metals", "room", "convex"}) {
    const Scene made = make_scene(name);
    save_scene(folder / "scene.glb", made);
    const Scene read = import_scene(folder / "scene.glb");
    EXPECT_EQ(read.triangle.size(), made.triangle.size()) << name;
    EXPECT_EQ(read.report.textures_missing, 0) << name;
    ASSERT_TRUE(read.camera.has_value()) << name;
    for (const Material& wanted : made.material) {
      const std::string what = std::string(name) + ", " + wanted.name;
      const Material& found = named(read, wanted.name);
      if (wanted.model == SurfaceModel::glass) {
        EXPECT_EQ(found.model, SurfaceModel::glass) << what;
        EXPECT_FLOAT_EQ(found.ior, wanted.ior) << what;
        EXPECT_EQ(found.thin, wanted.thin) << what;
        // Written as the colour after the way on which the strongest channel falls to 1 / e.
        expect_color(found.extinction, wanted.extinction, 1e-5f, what);
      }
      if (wanted.model == SurfaceModel::metallic_roughness) {
        EXPECT_EQ(found.model, SurfaceModel::metallic_roughness) << what;
        EXPECT_FLOAT_EQ(found.metallic, wanted.metallic) << what;
        EXPECT_FLOAT_EQ(found.roughness, wanted.roughness) << what;
      }
      expect_color(found.albedo, wanted.albedo, 1e-6f, what);
      EXPECT_EQ(found.alpha_cutoff, wanted.alpha_cutoff) << what;
      ASSERT_EQ(found.texture >= 0, wanted.texture >= 0) << what;
      if (wanted.texture < 0) continue;
      const auto f = static_cast<std::size_t>(found.texture),
                 w = static_cast<std::size_t>(wanted.texture);
      ASSERT_EQ(read.texture[f].pixels.size(), made.texture[w].pixels.size()) << what;
      const bool holes = !made.alpha[w].empty();
      if (holes) {
        ASSERT_EQ(read.alpha[f].size(), made.alpha[w].size()) << what;
      }
      for (std::size_t i = 0; i < made.texture[w].pixels.size(); ++i) {
        // Half a step of 8-bit sRGB is at most 0.0045.
        if (!holes || made.alpha[w][i] > 0) {
          expect_color(read.texture[f].pixels[i], made.texture[w].pixels[i], 0.0046f, what);
        }
        if (holes) {
          ASSERT_NEAR(read.alpha[f][i], made.alpha[w][i], 0.002f) << what;
        }
      }
    }
  }
}

}  // namespace
}  // namespace haarlight::data_gen
