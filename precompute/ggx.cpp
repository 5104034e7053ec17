// The GGX microfacet lobe: distribution, masking, visible normals, tabulated albedo.

#include "precompute/ggx.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "precompute/bsdf.h"
#include "precompute/fresnel.h"

namespace haarlight {
namespace {

// sqrt(alpha^2 + (1 - alpha^2) c^2) = c (1 + 2 Lambda), without a division by c.
double smith_root(double cosine, double alpha) {
  return std::sqrt(alpha * alpha + (1 - alpha * alpha) * cosine * cosine);
}

double distribution(const Vec3& n, const Vec3& h, double alpha) {
  const Vec3 across = cross(n, h);  // its square is 1 - (n.h)^2 without cancellation
  const double nh = dot(n, h);
  const double root = alpha * alpha * nh * nh + dot(across, across);
  return alpha * alpha / (kPi * root * root);
}

// ---- the albedo -----------------------------------------------------------------------------

// The nodes and weights of Gauss and Legendre on [0, 1].
template <std::size_t N>
std::array<std::pair<double, double>, N> gauss_nodes() {
  std::array<std::pair<double, double>, N> nodes;
  for (std::size_t i = 0; i < N; ++i) {
    double x = std::cos(kPi * (static_cast<double>(i) + 0.75) / (N + 0.5)), slope = 1;
    for (int step = 0; step < 20; ++step) {
      double p = 1, before = 0;
      for (std::size_t k = 1; k <= N; ++k) {
        const double n = static_cast<double>(k);
        const double next = ((2 * n - 1) * x * p - (n - 1) * before) / n;
        before = p, p = next;
      }
      slope = static_cast<double>(N) * (x * p - before) / (x * x - 1);
      x -= p / slope;
    }
    nodes[i] = {0.5 * (1 + x), 1 / ((1 - x * x) * slope * slope)};
  }
  return nodes;
}

// The lobe's albedo over its own sampling by a spherical cap: E = mean of F G2 / G1. Azimuths are
// symmetric about the view's plane, so half a turn is enough. Heights z of the cap start where
// light comes from the horizon; near it G2 falls to 0 within a layer, hence z squared.
Bsdf::LobeValues integrate(double cosine, double alpha) {
  const double s = schlick(cosine);
  if (alpha <= 0) return {1 - s, s};
  constexpr int kAzimuths = 16;
  static const auto heights = gauss_nodes<12>();
  const Vec3 o{std::sqrt(std::max(0.0, 1 - cosine * cosine)), 0, cosine};
  const Vec3 stretched = normalize(Vec3{alpha * o.x, 0, o.z});
  const double o_root = smith_root(o.z, alpha);
  Bsdf::LobeValues sum;
  for (int i = 0; i < kAzimuths; ++i) {
    const double azimuth = kPi * (i + 0.5) / kAzimuths;
    const double c = alpha * std::cos(azimuth), d = alpha * std::sin(azimuth);
    // The microfacet at height z of the cap: its half angle's cosine and the light's height.
    const auto light = [&](double z) {
      const double across = std::sqrt(std::max(0.0, 1 - z * z));
      const Vec3 m{across * c + alpha * stretched.x, across * d, z + stretched.z};
      const double square = dot(m, m), om = dot(o, m);
      return std::pair{om / std::sqrt(square), 2 * om * m.z / square - o.z};
    };
    double low = -stretched.z, high = 1;
    for (int step = 0; step < 10; ++step) {
      const double middle = 0.5 * (low + high);
      (light(middle).second > 0 ? high : low) = middle;
    }
    for (const auto& [t, weight] : heights) {
      const auto [oh, wz] = light(low + (1 - low) * t * t);
      if (!(wz > 0)) continue;
      // G2 / G1(o) = wz (oz + o_root) / (wz o_root + oz w_root), and z's share of the cap.
      const double share = wz * (o.z + o_root) / (wz * o_root + o.z * smith_root(wz, alpha)) *
                           weight * 2 * t * (1 - low) / (1 + stretched.z);
      const double f = schlick(oh);
      sum.first += share * (1 - f);
      sum.second += share * f;
    }
  }
  return {sum.first / kAzimuths, sum.second / kAzimuths};
}

// Over sqrt(cosine) and sqrt(alpha): both albedos change fastest near 0.
class AlbedoTable {
 public:
  AlbedoTable() : node_(kCosines * kAlphas), mean_(kAlphas) {
    for (std::size_t a = 0; a < kAlphas; ++a) {
      for (std::size_t c = 0; c < kCosines; ++c) {
        const double root = static_cast<double>(c) / (kCosines - 1);
        node_[a * kCosines + c] = integrate(root * root, alpha_of(a));
      }
    }
    // Means of the interpolated table, so that a coat and what lies below it add up; with t =
    // sqrt(cosine), 2 cosine dcosine = 4 t^3 dt.
    constexpr int kSteps = 8 * (kCosines - 1);
    for (std::size_t a = 0; a < kAlphas; ++a) {
      Mean& m = mean_[a];
      double weights = 0;
      for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps, weight = t * t * t;
        const Bsdf::LobeValues e = a == 0 ? integrate(t * t, 0) : value(t * t, alpha_of(a));
        const double lost = (1 - e.first - e.second) / (e.first + e.second);
        m.first += weight * e.first, m.second += weight * e.second;
        m.first_lost += weight * e.first * lost, m.second_lost += weight * e.second * lost;
        weights += weight;
      }
      m = (1 / weights) * m;
    }
  }

  Bsdf::LobeValues value(double cosine, double alpha) const {
    const auto [a, fa] = place(alpha, kAlphas);
    const auto [c, fc] = place(cosine, kCosines);
    const Bsdf::LobeValues* low = &node_[a * kCosines + c];
    const Bsdf::LobeValues* high = low + kCosines;
    const auto mix = [fa = fa, fc = fc](double ll, double lh, double hl, double hh) {
      return (1 - fa) * ((1 - fc) * ll + fc * lh) + fa * ((1 - fc) * hl + fc * hh);
    };
    return {mix(low[0].first, low[1].first, high[0].first, high[1].first),
            mix(low[0].second, low[1].second, high[0].second, high[1].second)};
  }

  // Cosine-weighted means of A, B, A (1 - E) / E and B (1 - E) / E, E = A + B.
  struct Mean {
    double first = 0, second = 0, first_lost = 0, second_lost = 0;
    friend Mean operator*(double s, const Mean& m) {
      return {s * m.first, s * m.second, s * m.first_lost, s * m.second_lost};
    }
    friend Mean operator+(const Mean& m, const Mean& n) {
      return {m.first + n.first, m.second + n.second, m.first_lost + n.first_lost,
              m.second_lost + n.second_lost};
    }
  };
  Mean mean(double alpha) const {
    const auto [a, f] = place(alpha, kAlphas);
    return (1 - f) * mean_[a] + f * mean_[a + 1];
  }

 private:
  static constexpr std::size_t kCosines = kAlbedoNodes, kAlphas = 56;
  static double alpha_of(std::size_t a) {
    const double root = static_cast<double>(a) / (kAlphas - 1);
    return root * root;
  }
  // The node below the square root of `value` and how far beyond it.
  static std::pair<std::size_t, double> place(double value, std::size_t nodes) {
    const double x = std::sqrt(std::clamp(value, 0.0, 1.0)) * static_cast<double>(nodes - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(x), nodes - 2);
    return {i, x - static_cast<double>(i)};
  }

  std::vector<Bsdf::LobeValues> node_;
  std::vector<Mean> mean_;
};

const AlbedoTable& albedo_table() {
  static const AlbedoTable table;
  return table;
}

}  // namespace

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
double ggx_times_cosine(const Vec3& n, const Vec3& w, const Vec3& o, double alpha,
                        double& half_cosine) {
  half_cosine = 0;
  const double nw = dot(n, w), no = dot(n, o);
  const Vec3 sum = w + o;
  const double size = length(sum);
  if (!(nw > 0) || !(no >= 0) || !(size > 0)) return 0;
  const Vec3 h = sum * (1 / size);
  half_cosine = std::clamp(dot(w, h), 0.0, 1.0);
  // V n.w = 1 / (2 (no / nw w_root + o_root)): finite for any no >= 0 and nw > 0.
  const double masking = 0.5 / (no / nw * smith_root(nw, alpha) + smith_root(no, alpha));
  return distribution(n, h, alpha) * masking;
}

double ggx_pdf(const Vec3& n, const Vec3& w, const Vec3& o, double alpha) {
  const double no = dot(n, o);
  const Vec3 sum = w + o;
  const double size = length(sum);
  if (!(dot(n, w) > 0) || !(no >= 0) || !(size > 0)) return 0;
  // G1(o) D / (4 n.o) with G1 = 2 n.o / (n.o + o_root).
  return distribution(n, sum * (1 / size), alpha) / (2 * (no + smith_root(no, alpha)));
}

std::optional<Vec3> ggx_sample(const Vec3& n, const Vec3& o, double alpha, double u, double v) {
  const Frame frame(n);
  const Vec3 local = frame.to_local(o);
  const Vec3 stretched = normalize(Vec3{alpha * local.x, alpha * local.y, std::max(local.z, 0.0)});
  const double z = (1 - v) * (1 + stretched.z) - stretched.z;
  const double across = std::sqrt(std::max(0.0, 1 - z * z));
  const Vec3 m =
      Vec3{across * std::cos(2 * kPi * u), across * std::sin(2 * kPi * u), z} + stretched;
  const Vec3 tilted{alpha * m.x, alpha * m.y, std::max(m.z, 0.0)};
  const double size = length(tilted);
  if (!(size > 0)) return std::nullopt;
  const Vec3 h = frame.to_world(tilted * (1 / size));
  const Vec3 w = normalize(2 * dot(o, h) * h - o);
  if (!(dot(n, w) > 0)) return std::nullopt;
  return w;
}

Bsdf::LobeValues ggx_albedo(double cosine, double alpha) {
  if (alpha <= 0) return integrate(cosine, 0);
  return albedo_table().value(cosine, alpha);
}

Bsdf::LobeValues ggx_mean_albedo(double alpha) {
  const auto mean = albedo_table().mean(alpha);
  return {mean.first, mean.second};
}

void ggx_albedo_nodes(double alpha, std::span<float, 2 * kAlbedoNodes> nodes) {
  for (std::size_t i = 0; i < kAlbedoNodes; ++i) {
    const double root = static_cast<double>(i) / (kAlbedoNodes - 1);
    const Bsdf::LobeValues e = ggx_albedo(root * root, alpha);
    nodes[2 * i] = static_cast<float>(e.first);
    nodes[2 * i + 1] = static_cast<float>(e.second);
  }
}

double coat_albedo(double cosine, double alpha, double f0) {
  const Bsdf::LobeValues e = ggx_albedo(cosine, alpha);
  const double all = e.first + e.second;
  return std::clamp((f0 * e.first + e.second) * (1 + f0 * (1 - all) / all), 0.0, 1.0);
}

double coat_mean_albedo(double alpha, double f0) {
  const auto m = albedo_table().mean(alpha);
  return std::clamp(f0 * m.first + m.second + f0 * (f0 * m.first_lost + m.second_lost), 0.0, 1.0);
}

}  // namespace haarlight
