// A plain path tracer.

#include "tests/reference/path_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/parallel.h"
#include "precompute/bsdf.h"
#include "precompute/surface.h"
#include "precompute/texture.h"

namespace haarlight::reference {
namespace {

double largest(const RgbD& c) { return std::max({c.r, c.g, c.b}); }

template <typename T>
T interpolate(const std::array<T, 3>& corner, const TriangleTree::Hit& hit) {
  return corner[0] * (1 - hit.b1 - hit.b2) + corner[1] * hit.b1 + corner[2] * hit.b2;
}

// Any two directions that make a right-handed frame with `axis`.
Vec3 about(const Vec3& axis, double cosine, double turn) {
  const Vec3 side = normalize(cross(axis, std::abs(axis.x) < 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  return normalize(axis * cosine +
                   (side * std::cos(turn) + cross(axis, side) * std::sin(turn)) * sine);
}

Vec3 mirrored(const Vec3& to_viewer, const Vec3& normal) {
  return normalize(2 * dot(normal, to_viewer) * normal - to_viewer);
}

// `normal` turned towards `direction` until it is just above its horizon, as surfaces in
// precompute/surface.h have it.
Vec3 facing(const Vec3& normal, const Vec3& direction) {
  const double cosine = dot(normal, direction);
  return cosine > 0 ? normal : normalize(normal + (1e-3 - cosine) * direction);
}

// Unpolarised reflectance of a smooth surface; `eta` is the index of refraction on the other side
// over that on this side.
double fresnel(double cosine, double eta) {
  const double sine_squared = (1 - cosine * cosine) / (eta * eta);
  if (sine_squared >= 1) return 1;  // total reflection
  const double inner = std::sqrt(1 - sine_squared);
  const double s = (cosine - eta * inner) / (cosine + eta * inner);
  const double p = (eta * cosine - inner) / (eta * cosine + inner);
  return 0.5 * (s * s + p * p);
}

}  // namespace

// SplitMix64, a stream for each path.
class PathTracer::Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream, std::uint64_t path)
      : state_(mix(mix(mix(seed) + stream) + path)) {}
  double unit() {
    state_ += 0x9e3779b97f4a7c15u;
    return static_cast<double>(mix(state_) >> 11) * 0x1p-53;
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

// What a ray has met.
struct PathTracer::Surface {
  Vec3 position, geometric_normal, normal, to_viewer;  // normals on the viewer's side

  // Lambert and Phong.
  RgbD diffuse, gloss;
  double exponent = 0;
  Vec3 mirror;
  std::optional<Bsdf> coated;  // metallic-roughness, instead of both
  // Chances of the parts; together at most 1.
  double diffuse_chance = 0, gloss_chance = 0;

  struct Delta {
    Vec3 direction;
    RgbD weight;
    double chance = 0;
    bool transmitted = false;
    RgbD extinction;    // from here on, if transmitted
    double denser = 1;  // the part of `weight` that is won back on the way out
  };
  std::array<Delta, 2> delta;

  bool scatters() const { return diffuse_chance + gloss_chance > 0; }
  bool above(const Vec3& w) const { return dot(w, normal) > 0 && dot(w, geometric_normal) > 0; }

  // BRDF times cosine for light from w.
  RgbD factor(const Vec3& w) const {
    if (!above(w)) return {};
    if (coated) {
      const Bsdf::LobeValues lobe = coated->lobe_values(w);
      return coated->diffuse_out(to_viewer) * coated->diffuse_in(w) +
             coated->gloss_first * lobe.first + coated->gloss_second * lobe.second;
    }
    const double along = std::max(0.0, dot(w, mirror));
    return (diffuse * (1 / kPi) +
            gloss * ((exponent + 2) / (2 * kPi) * std::pow(along, exponent))) *
           dot(w, normal);
  }
  // Density of scatter(), chances of the parts included.
  double density(const Vec3& w) const {
    double sum = diffuse_chance * std::max(0.0, dot(w, normal)) / kPi;
    if (coated && gloss_chance > 0) {
      sum += gloss_chance * coated->lobe_pdf(w);
    } else if (gloss_chance > 0) {
      sum += gloss_chance * (exponent + 1) / (2 * kPi) *
             std::pow(std::max(0.0, dot(w, mirror)), exponent);
    }
    return sum;
  }
  // Nothing where a lobe points below the horizon.
  std::optional<Vec3> scatter(bool glossy, Random& random) const {
    const double u = random.unit(), v = random.unit();
    if (glossy && coated) {
      const auto sample = coated->sample_lobe(u, v);
      return sample ? std::optional(sample->direction) : std::nullopt;
    }
    const double turn = 2 * kPi * v;
    if (glossy) return about(mirror, std::pow(1 - u, 1 / (exponent + 1)), turn);
    return about(normal, std::sqrt(1 - u), turn);
  }
};

namespace {

// By Snell's law the part across the normal shrinks by eta.
std::optional<Vec3> refracted(const Vec3& direction, const Vec3& normal, double eta) {
  const Vec3 across = (direction - dot(direction, normal) * normal) * (1 / eta);
  const double sine_squared = dot(across, across);
  if (sine_squared >= 1) return std::nullopt;
  return normalize(across - normal * std::sqrt(1 - sine_squared));
}

}  // namespace

PathTracer::PathTracer(const Scene& scene, const Sky& sky, const PathOptions& options)
    : scene_(scene), sky_(sky), options_(options), tree_(scene) {
  for (const std::vector<float>& alpha : scene.alpha) {
    Image image;
    if (!alpha.empty()) {
      const Image& colors = scene.texture[alpha_.size()];
      image = Image(colors.width, colors.height);
      for (std::size_t i = 0; i < alpha.size(); ++i) image.pixels[i] = {alpha[i], 0, 0};
    }
    alpha_.push_back(std::move(image));
  }
  for (const Material& m : scene.material) {
    has_holes_ = has_holes_ || m.alpha_cutoff > 0;
    if (m.model == SurfaceModel::measured) {
      throw Error(ErrorKind::invalid_argument,
                  "a measured BRDF, which the reference does not know");
    }
    if (m.normal_texture >= 0) {
      throw Error(ErrorKind::invalid_argument,
                  scene.name + ": material " + m.name + " has a normal texture, expected none");
    }
  }
}

bool PathTracer::is_hole(const TriangleTree::Hit& hit) const {
  const Triangle& t = scene_.triangle[hit.triangle];
  const Material& m = scene_.material[t.material];
  if (!(m.alpha_cutoff > 0) || m.texture < 0) return false;
  const auto texture = static_cast<std::size_t>(m.texture);
  if (texture >= alpha_.size() || alpha_[texture].pixels.empty()) return false;
  std::array<double, 3> u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    u[k] = static_cast<double>(scene_.uv[t.vertex[k]][0]);
    v[k] = static_cast<double>(scene_.uv[t.vertex[k]][1]);
  }
  return sample_texture(alpha_[texture], interpolate(u, hit), interpolate(v, hit)).r <
         m.alpha_cutoff;
}

std::optional<TriangleTree::Hit> PathTracer::first_hit(const Vec3& origin, const Vec3& direction,
                                                       bool any) const {
  if (!has_holes_) return tree_.hit(origin, direction, any);
  double nearer = 0;
  for (;;) {
    const auto hit = tree_.hit(origin, direction, false, nearer);
    if (!hit || !is_hole(*hit)) return hit;
    nearer = hit->distance + 1e-12 * tree_.extent();
  }
}

PathTracer::Surface PathTracer::surface(const TriangleTree::Hit& hit, const Vec3& direction) const {
  const Triangle& t = scene_.triangle[hit.triangle];
  const Material& m = scene_.material[t.material];
  std::array<Vec3, 3> corner, normal;
  std::array<RgbD, 3> tint;
  std::array<double, 3> u, v;
  for (std::size_t k = 0; k < 3; ++k) {
    corner[k] = scene_.position[t.vertex[k]];
    normal[k] = scene_.normal[t.vertex[k]];
    tint[k] = scene_.tint.empty() ? RgbD{1, 1, 1} : RgbD(scene_.tint[t.vertex[k]]);
    u[k] = static_cast<double>(scene_.uv[t.vertex[k]][0]);
    v[k] = static_cast<double>(scene_.uv[t.vertex[k]][1]);
  }
  Surface s;
  s.position = interpolate(corner, hit);
  s.to_viewer = -direction;
  s.geometric_normal = normalize(cross(corner[1] - corner[0], corner[2] - corner[0]));
  const bool from_behind = dot(s.geometric_normal, direction) > 0;
  if (from_behind) s.geometric_normal = -s.geometric_normal;
  s.normal = normalize(interpolate(normal, hit));
  if (dot(s.normal, s.geometric_normal) < 0) s.normal = -s.normal;
  s.normal = facing(s.normal, s.to_viewer);
  // A smooth normal may send single directions to the wrong side; the true one never does.
  const auto reflected = [&s] {
    const Vec3 smooth = mirrored(s.to_viewer, s.normal);
    return dot(smooth, s.geometric_normal) > 0 ? smooth : mirrored(s.to_viewer, s.geometric_normal);
  };

  RgbD albedo = RgbD(m.albedo) * interpolate(tint, hit);
  if (m.texture >= 0) {
    albedo = albedo * RgbD(sample_texture(scene_.texture[static_cast<std::size_t>(m.texture)],
                                          interpolate(u, hit), interpolate(v, hit)));
  }
  switch (m.model) {
    case SurfaceModel::measured:  // refused by the constructor
      break;
    case SurfaceModel::phong:
      s.diffuse = albedo;
      s.diffuse_chance = largest(albedo);
      if (options_.gloss) {
        s.gloss = RgbD(m.specular);
        s.gloss_chance = largest(s.gloss);
        s.exponent = static_cast<double>(m.exponent);
        s.mirror = mirrored(s.to_viewer, s.normal);
      }
      break;
    case SurfaceModel::metallic_roughness: {
      SurfaceHit seen;
      seen.position = s.position;
      seen.geometric_normal = s.geometric_normal;
      seen.normal = s.normal;
      seen.to_viewer = s.to_viewer;
      seen.material = t.material;
      seen.albedo = Rgb(albedo);
      seen.metallic = m.metallic;
      seen.roughness = m.roughness;
      if (m.metallic_roughness_texture >= 0) {
        const Rgb factor =
            sample_texture(scene_.texture[static_cast<std::size_t>(m.metallic_roughness_texture)],
                           interpolate(u, hit), interpolate(v, hit));
        seen.metallic *= factor.b, seen.roughness *= factor.g;
      }
      seen.outside = !from_behind;
      s.coated = bsdf_at(scene_, seen);
      s.diffuse_chance = largest(s.coated->diffuse_albedo());
      if (options_.gloss) s.gloss_chance = largest(s.coated->lobe_albedo());
      if (!options_.gloss) s.coated->lobe = Bsdf::Lobe::none;
      for (std::size_t k = 0; k < static_cast<std::size_t>(s.coated->delta_count); ++k) {
        const Bsdf::Delta& d = s.coated->delta[k];
        s.delta[k] = {d.direction, d.weight, largest(d.weight), d.transmitted, {}};
      }
      break;
    }
    case SurfaceModel::mirror:
      s.delta[0] = {reflected(), albedo, largest(albedo), false, {}};
      break;
    case SurfaceModel::glass: {
      const double index = static_cast<double>(m.ior);
      const double eta = m.thin || !from_behind ? index : 1 / index;
      double share = fresnel(dot(s.normal, s.to_viewer), eta);
      if (m.thin) share = 2 * share / (1 + share);  // back and forth between both faces
      s.delta[0] = {reflected(), RgbD{share, share, share}, share, false, {}};
      std::optional<Vec3> bent = m.thin ? direction : refracted(direction, s.normal, eta);
      if (bent && !(dot(*bent, s.geometric_normal) < 0)) {
        bent = refracted(direction, s.geometric_normal, eta);
      }
      if (share == 1 || !bent) break;
      // Radiance goes with the square of the index.
      const double denser = m.thin ? 1 : 1 / (eta * eta);
      s.delta[1] = {*bent,
                    albedo * ((1 - share) * denser),
                    1 - share,
                    true,
                    from_behind || m.thin ? RgbD{} : RgbD(m.extinction),
                    denser};
      break;
    }
  }
  return s;
}

// Light from a direction of the sky aimed at, balanced with what scattering would find.
RgbD PathTracer::aimed(const Surface& s, Random& random) const {
  const double choice = random.unit(), u = random.unit(), v = random.unit();
  const auto sample = sky_.sample(choice, u, v);
  if (!sample) return {};
  const RgbD factor = s.factor(sample->direction);
  if (!(largest(factor) > 0)) return {};
  const Vec3 start = s.position + s.geometric_normal * (1e-9 * tree_.extent());
  if (options_.shadows && first_hit(start, sample->direction, true)) return {};
  return factor * sky_.radiance(sample->direction) *
         (1 / (sample->density + s.density(sample->direction)));
}

RgbD PathTracer::path(Vec3 origin, Vec3 direction, Random& random) const {
  RgbD light, throughput{1, 1, 1}, extinction;
  int scattered = 0;   // diffuse and glossy surfaces met
  double density = 0;  // of the direction, if the last surface scattered
  double denser = 1;   // how much of the throughput is won back where it leaves glass
  bool single = true;  // the direction is a mirror's or glass's, or the camera's
  const auto sky = [&] {
    const bool balanced = options_.next_event && !single;
    const double weight = balanced ? density / (density + sky_.density(direction)) : 1;
    return throughput * sky_.radiance(direction) * weight;
  };
  for (int depth = 0;; ++depth) {
    const auto hit = first_hit(origin, direction);
    if (!hit) return depth == 0 && !options_.background ? light : light + sky();
    throughput = throughput * RgbD{std::exp(-extinction.r * hit->distance),
                                   std::exp(-extinction.g * hit->distance),
                                   std::exp(-extinction.b * hit->distance)};
    Surface s = surface(*hit, direction);
    if (scattered > options_.max_bounces) s.diffuse_chance = s.gloss_chance = 0;
    if (!(scattered == 0 ? options_.specular : options_.caustics)) s.delta = {};
    double sum = s.diffuse_chance + s.gloss_chance + s.delta[0].chance + s.delta[1].chance;
    if (!(sum > 0)) return light;
    for (double* chance :
         {&s.diffuse_chance, &s.gloss_chance, &s.delta[0].chance, &s.delta[1].chance}) {
      *chance /= sum;
    }
    if (options_.next_event && s.scatters()) light += throughput * aimed(s, random);

    double choice = random.unit();
    const double offset = 1e-9 * tree_.extent();
    const Surface::Delta* delta = nullptr;
    for (const Surface::Delta& d : s.delta) {
      if (delta == nullptr && choice < d.chance) delta = &d;
      if (delta == nullptr) choice -= d.chance;
    }
    if (delta != nullptr) {
      single = true;
      direction = delta->direction;
      throughput = throughput * delta->weight * (1 / delta->chance);
      if (delta->transmitted) extinction = delta->extinction, denser *= delta->denser;
      origin = s.position + s.geometric_normal * (delta->transmitted ? -offset : offset);
    } else {
      if (!s.scatters()) return light;  // the last chance was rounded away
      single = false;
      ++scattered;
      const auto way = s.scatter(choice >= s.diffuse_chance, random);
      if (!way) return light;
      direction = *way;
      density = s.density(direction);
      const RgbD factor = s.factor(direction);
      if (!(largest(factor) > 0)) return light;
      throughput = throughput * factor * (1 / density);
      if (!options_.shadows) return light + sky();
      origin = s.position + s.geometric_normal * offset;
    }
    // Russian roulette.
    if (depth < 3) continue;
    const double stay = std::min(0.95, largest(throughput) / denser);
    if (random.unit() >= stay) return light;
    throughput *= 1 / stay;
  }
}

namespace {

// Mean and spread of paths, by Welford's update.
class Gather {
 public:
  void add(const RgbD& value) {
    ++count_;
    const RgbD off = value - mean_;
    mean_ += off * (1.0 / count_);
    const RgbD still_off = value - mean_;
    squares_ += off * still_off;
    sum_squares_ += (off.r + off.g + off.b) * (still_off.r + still_off.g + still_off.b);
  }
  Estimate estimate() const {
    const double scale = 1.0 / count_ / std::max(1.0, count_ - 1.0);
    return {mean_, squares_ * scale, sum_squares_ * scale};
  }

 private:
  double count_ = 0;
  RgbD mean_, squares_;
  double sum_squares_ = 0;
};

}  // namespace

Estimate PathTracer::radiance(const Vec3& origin, const Vec3& direction,
                              std::uint64_t stream) const {
  Gather gather;
  for (int i = 0; i < options_.samples; ++i) {
    Random random(options_.seed, stream, static_cast<std::uint64_t>(i));
    gather.add(path(origin, direction, random));
  }
  return gather.estimate();
}

std::vector<Estimate> PathTracer::pixels(const Camera& camera,
                                         std::span<const std::uint32_t> which) const {
  std::vector<Estimate> out(which.size());
  parallel_for(static_cast<int>(which.size()), [&](int index) {
    const std::uint32_t pixel = which[static_cast<std::size_t>(index)];
    const auto width = static_cast<std::uint32_t>(camera.width);
    const double x = pixel % width, y = pixel / width;
    Gather gather;
    for (int i = 0; i < options_.samples; ++i) {
      Random random(options_.seed, pixel, static_cast<std::uint64_t>(i));
      const double u = random.unit(), v = random.unit();
      gather.add(path(camera.position,
                      options_.pixel_centers ? camera.direction(x + 0.5, y + 0.5)
                                             : camera.direction(x + u, y + v),
                      random));
    }
    out[static_cast<std::size_t>(index)] = gather.estimate();
  });
  return out;
}

std::vector<Estimate> PathTracer::picture(const Camera& camera) const {
  std::vector<std::uint32_t> all(static_cast<std::size_t>(camera.width) *
                                 static_cast<std::size_t>(camera.height));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
  return pixels(camera, all);
}

Image picture_of(std::span<const Estimate> estimates, int width, int height) {
  Image image(width, height);
  for (std::size_t i = 0; i < estimates.size(); ++i) image.pixels[i] = Rgb(estimates[i].mean);
  return image;
}

}  // namespace haarlight::reference
