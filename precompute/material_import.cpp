// Materials of scene files into those of the scene.

#include "precompute/material_import.h"

#include <assimp/GltfMaterial.h>
#include <assimp/ObjMaterial.h>
#include <assimp/material.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "precompute/bsdf.h"
#include "precompute/measured_brdf.h"

namespace haarlight {
namespace {

// No alpha reaches it.
constexpr float kAllHole = 2;
// Above this a surface is rather glass than anything else.
constexpr float kMostly = 0.5f;

float number(float value, float fallback) { return std::isfinite(value) ? value : fallback; }
float unit(float value, float fallback) { return std::clamp(number(value, fallback), 0.0f, 1.0f); }

std::string texture_path(const aiMaterial& in, aiTextureType type) {
  aiString path;
  return in.GetTexture(type, 0, &path) == aiReturn_SUCCESS ? path.C_Str() : "";
}

// Holes where `alpha`, the material's, times the texture's (if it has any) is below `cutoff`.
void cut_holes(Material& out, float alpha, float cutoff, const TextureImport& textures) {
  if (!(cutoff > 0)) return;
  if (textures.has_alpha(out.texture)) {
    out.alpha_cutoff = alpha > 0 ? std::min(cutoff / alpha, kAllHole) : kAllHole;
  } else if (alpha < cutoff) {
    out.alpha_cutoff = kAllHole;
  }
}

// An even veil: of light straight through, 1 - alpha passes, and alpha of the colour is left. As a
// wall of base b that lets t pass, b t = 1 - alpha and b (1 - t) = alpha colour; one t for all
// channels keeps their mean.
void make_veil(Material& out, float alpha) {
  const float open = 1 - alpha;
  out.albedo = out.albedo * alpha + Rgb{open, open, open};
  const float mean = (out.albedo.r + out.albedo.g + out.albedo.b) / 3;
  out.transmission = std::min(open / std::max(mean, 1e-6f), 1.0f);
}

void apply_alpha(Material& out, const GltfMaterial& numbers, const TextureImport& textures,
                 SceneReport& report) {
  using Alpha = GltfMaterial::Alpha;
  if (numbers.alpha_mode == Alpha::mask) {
    cut_holes(out, numbers.alpha, numbers.alpha_cutoff, textures);
  }
  if (numbers.alpha_mode != Alpha::blend) return;
  const bool is_veil = numbers.alpha < 1 && !textures.has_alpha(out.texture);
  if (!is_veil && !textures.has_alpha(out.texture)) return;
  ++report.blended_materials;
  if (!is_veil) {
    cut_holes(out, numbers.alpha, kMostly, textures);
  } else if (out.transmission == 0 && out.model == SurfaceModel::metallic_roughness) {
    make_veil(out, numbers.alpha);
  }
}

// The brightest texel, channel by channel; white without a texture.
Rgb brightest(const Scene& scene, int texture) {
  if (texture < 0) return {1, 1, 1};
  Rgb most;
  for (const Rgb& p : scene.texture[static_cast<std::size_t>(texture)].pixels) {
    most = {std::max(most.r, p.r), std::max(most.g, p.g), std::max(most.b, p.b)};
  }
  return most;
}

// Diffuse and specular together reflect at most all, channel by channel.
void limit_energy(Material& out, const Scene& scene, SceneReport& report) {
  const Rgb all = out.albedo * brightest(scene, out.texture) + out.specular;
  const float most = std::max({all.r, all.g, all.b});
  // Files carry decimals: 0.7 + 0.3 is above 1 in floats.
  if (!(most > 1.000001f)) return;
  out.albedo *= 1 / most, out.specular *= 1 / most;
  ++report.energy_scaled;
}

Rgb color(const aiMaterial& in, const char* key, unsigned type, unsigned number_of,
          const Rgb& fallback) {
  aiColor3D c;
  if (in.Get(key, type, number_of, c) != aiReturn_SUCCESS) return fallback;
  return {unit(c.r, fallback.r), unit(c.g, fallback.g), unit(c.b, fallback.b)};
}

}  // namespace

Material import_gltf_material(const GltfMaterial& numbers, const aiMaterial& in,
                              TextureImport& textures, const Scene& scene, SceneReport& report) {
  Material out;
  out.model = SurfaceModel::metallic_roughness;
  out.albedo = numbers.base;
  out.metallic = numbers.metallic, out.roughness = numbers.roughness;
  out.ior = numbers.ior;
  out.transmission = numbers.transmission;
  const bool has_alpha = numbers.alpha_mode != GltfMaterial::Alpha::opaque;
  std::string base = texture_path(in, aiTextureType_BASE_COLOR);
  if (base.empty()) base = texture_path(in, aiTextureType_DIFFUSE);
  if (has_alpha) {
    out.texture = textures.index_with_alpha(base, "");
  } else {
    out.texture = textures.index(base, ImageEncoding::color);
  }
  out.normal_texture = textures.index(texture_path(in, aiTextureType_NORMALS), ImageEncoding::data);
  out.normal_scale = numbers.normal_scale;
  out.map = numbers.base_map;
  out.metallic_roughness_map = numbers.metallic_roughness_map;
  out.normal_map = numbers.normal_map;

  if (numbers.transmission > 0 && numbers.roughness >= kMirrorRoughness) ++report.rough_glass;
  if (numbers.has_inside && numbers.transmission >= kMostly && numbers.metallic < kMostly) {
    out.model = SurfaceModel::glass;
    out.transmission = 0;
    out.extinction = numbers.extinction;
  } else {
    // METALLICROUGHNESS_TEXTURE is of "unknown" type in assimp.
    out.metallic_roughness_texture =
        textures.index(texture_path(in, aiTextureType_UNKNOWN), ImageEncoding::data);
  }
  if (numbers.phong) {
    out.model = SurfaceModel::phong;
    out.albedo = numbers.diffuse;
    out.specular = numbers.specular, out.exponent = numbers.exponent;
    out.transmission = 0;
    out.metallic_roughness_texture = -1;
    limit_energy(out, scene, report);
  }
  apply_alpha(out, numbers, textures, report);
  return out;
}

void set_measured(Scene& scene, std::size_t m, const std::filesystem::path& file) {
  const Material& old = scene.material[m];
  Material out;
  out.name = old.name;
  out.model = SurfaceModel::measured;
  out.albedo = {1, 1, 1};
  out.measured = std::make_shared<const MeasuredBrdf>(read_merl(file));
  out.normal_texture = old.normal_texture;
  out.normal_map = old.normal_map;
  out.normal_scale = old.normal_scale;
  out.alpha_cutoff = old.alpha_cutoff;
  if (old.alpha_cutoff > 0 && old.texture >= 0) {
    const auto base = static_cast<std::size_t>(old.texture);
    Image white(scene.texture[base].width, scene.texture[base].height);
    std::fill(white.pixels.begin(), white.pixels.end(), Rgb{1, 1, 1});
    out.texture = static_cast<int>(scene.texture.size());
    out.map = old.map;
    scene.texture.push_back(std::move(white));
    scene.alpha.resize(scene.texture.size());
    scene.alpha.back() = scene.alpha[base];
  }
  if (old.texture >= 0) ++scene.report.measured_textures;
  scene.material[m] = out;
}

Material import_obj_material(const aiMaterial& in, TextureImport& textures, const Scene& scene,
                             SceneReport& report) {
  Material out;
  const Rgb diffuse = color(in, AI_MATKEY_COLOR_DIFFUSE, out.albedo);
  const Rgb specular = color(in, AI_MATKEY_COLOR_SPECULAR, out.specular);
  int illum = 2;
  float opacity = 1, value = 0;
  in.Get(AI_MATKEY_OBJ_ILLUM, illum);
  in.Get(AI_MATKEY_OPACITY, opacity);
  opacity = unit(opacity, 1);
  // The reader says 1 where there is no Ni, and glass of 1 would be none.
  if (in.Get(AI_MATKEY_REFRACTI, value) == aiReturn_SUCCESS && value != 1) {
    out.ior = std::clamp(number(value, out.ior), 1.0f, 100.0f);
  }
  out.normal_texture = textures.index(texture_path(in, aiTextureType_NORMALS), ImageEncoding::data);
  float metallic = 0, roughness = 1;
  const bool has_metallic = in.Get(AI_MATKEY_METALLIC_FACTOR, metallic) == aiReturn_SUCCESS;
  const bool has_roughness = in.Get(AI_MATKEY_ROUGHNESS_FACTOR, roughness) == aiReturn_SUCCESS;

  switch (illum) {
    case 3:
    case 5:
      out.model = SurfaceModel::mirror;
      out.albedo = l1_norm(specular) > 0 ? specular : diffuse;
      return out;
    case 4:
    case 6:
    case 7:
    case 9:
      out.model = SurfaceModel::glass;
      out.albedo = color(in, AI_MATKEY_COLOR_TRANSPARENT, {1, 1, 1});
      if (l1_norm(out.albedo) == 0) out.albedo = {1, 1, 1};  // no glass lets nothing through
      // Tf is of the body, which is passed by way of two surfaces.
      out.albedo = {std::sqrt(out.albedo.r), std::sqrt(out.albedo.g), std::sqrt(out.albedo.b)};
      return out;
    default:
      break;
  }
  out.albedo = diffuse;
  if (has_metallic || has_roughness) {
    out.model = SurfaceModel::metallic_roughness;
    out.metallic = unit(metallic, 0), out.roughness = unit(roughness, 1);
  } else {
    out.specular = specular;
    if (in.Get(AI_MATKEY_SHININESS, value) == aiReturn_SUCCESS) {
      out.exponent = std::clamp(number(value, out.exponent), 0.0f, 1e4f);
    }
  }
  const std::string mask = texture_path(in, aiTextureType_OPACITY);
  const std::string base = texture_path(in, aiTextureType_DIFFUSE);
  out.texture = mask.empty() ? textures.index(base, ImageEncoding::color)
                             : textures.index_with_alpha(base, mask);
  if (opacity < 1 || textures.has_alpha(out.texture)) {
    ++report.blended_materials;
    cut_holes(out, opacity, kMostly, textures);
  }
  if (out.model == SurfaceModel::phong) limit_energy(out, scene, report);
  return out;
}

}  // namespace haarlight
