// How many products of incoming and outgoing factors a BRDF is worth.

#include "precompute/brdf_terms.h"

#include <Eigen/SVD>
#include <cmath>
#include <vector>

#include "precompute/bsdf.h"
#include "precompute/random.h"
#include "precompute/surface.h"

namespace haarlight {

int brdf_terms(const Material& material, double error) {
  Scene scene;
  scene.material.push_back(material);
  Material& plain = scene.material.front();
  plain.texture = plain.metallic_roughness_texture = plain.normal_texture = -1;
  SurfaceHit hit;
  hit.geometric_normal = hit.normal = {0, 1, 0};
  hit.albedo = plain.albedo;
  hit.metallic = plain.metallic;
  hit.roughness = plain.roughness;

  // Even directions about the normal, cosine distributed, so that each stands for the same power;
  // light comes from their mirror images, so that narrow lobes are met.
  constexpr int kDirections = 4 * kMostBrdfTerms;
  constexpr double kShift[4] = {0, 0, 0.5, 0.5};
  std::vector<Vec3> direction;
  for (int i = 0; i < kDirections; ++i) {
    const EvenPoint u = even_point(static_cast<std::uint64_t>(i), kShift);
    direction.push_back(cosine_direction({0, 1, 0}, u.value[2], u.value[3]));
  }
  Eigen::MatrixXd samples(kDirections, kDirections);
  for (int o = 0; o < kDirections; ++o) {
    hit.to_viewer = direction[static_cast<std::size_t>(o)];
    const Bsdf b = bsdf_at(scene, hit);
    if (b.is_specular()) return 0;
    for (int i = 0; i < kDirections; ++i) {
      const Vec3& d = direction[static_cast<std::size_t>(i)];
      const Vec3 w{-d.x, d.y, -d.z};
      RgbD f = b.diffuse_out(b.to_viewer) * b.diffuse_in(w);
      if (b.has_lobe()) {
        const Bsdf::LobeValues v = b.lobe_values(w);
        f += v.first * b.gloss_first + v.second * b.gloss_second;
      }
      samples(i, o) = luminance(f) / std::max(w.y, 1e-3);
    }
  }
  const Eigen::VectorXd s = Eigen::BDCSVD<Eigen::MatrixXd>(samples).singularValues();
  const double all = s.squaredNorm();
  double left = all;
  int k = 0;
  while (k <= kMostBrdfTerms && left > error * error * all) {
    left -= s[k] * s[k];
    ++k;
  }
  return std::max(k, 1);
}

}  // namespace haarlight
