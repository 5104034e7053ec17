// The vertices of a mesh as places where light is gathered.

#include "precompute/vertex_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "precompute/bsdf.h"
#include "precompute/surface.h"
#include "precompute/texture.h"
#include "precompute/vertex_places.h"
#include "prt/transport.h"

namespace haarlight {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr double kInwards = 1e-3;      // of the way to the middle of the vertex's triangles
constexpr double kRises = 1e-6;        // sine of the angle above which a neighbour is in the way
constexpr double kLeastCosine = 0.05;  // of the way off a plane that is still taken

// A direction well off all planes with these unit normals, by moving towards the worst one.
Vec3 away_from(std::span<const Vec3> normals, const Vec3& start, double& least) {
  const auto worst = [&](const Vec3& g) {
    std::size_t at = 0;
    least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < normals.size(); ++i) {
      const double cosine = dot(normals[i], g);
      if (cosine < least) least = cosine, at = i;
    }
    return at;
  };
  Vec3 best = start, g = start;
  std::size_t at = worst(g);
  double best_least = least;
  for (int step = 1; step <= 64 && !normals.empty(); ++step) {
    const Vec3 moved = g + normals[at] * (1.0 / (1 + step));
    const double size = length(moved);
    if (!(size > 1e-9)) break;
    g = moved * (1 / size);
    at = worst(g);
    if (least > best_least) best_least = least, best = g;
  }
  least = best_least;
  return best;
}

}  // namespace

VertexSampler::VertexSampler(const Scene& scene, const Visibility& visibility)
    : scene_(scene), visibility_(visibility) {
  const std::size_t vertices = scene.position.size();
  position_.reserve(vertices);
  for (const Vec3& p : scene.position) position_.push_back(visibility.to_local(p));
  place_ = vertex_places(position_);
  material_.assign(vertices, kNone);
  first_.assign(vertices + 1, 0);
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      ++first_[place_[v] + 1];
      if (material_[v] == kNone) material_[v] = t.material;
    }
  }
  for (std::size_t p = 0; p < vertices; ++p) first_[p + 1] += first_[p];
  triangles_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    for (const std::uint32_t v : scene.triangle[t].vertex) {
      triangles_[next[place_[v]]++] = static_cast<std::uint32_t>(t);
    }
  }
  join_sheets();
  for (const std::uint32_t m : material_) {
    if (m == kNone) continue;
    const Material& material = scene.material[m];
    view_dependent_ += material.model != SurfaceModel::phong || l1_norm(material.specular) > 0;
  }
}

// Vertices of one place and normal whose triangles meet along an edge, as at the seam of a texture,
// are of one sheet. Where more than two triangles meet something stands on the edge, and what lies
// on either side of it may see different things.
void VertexSampler::join_sheets() {
  sheet_.resize(position_.size());
  for (std::uint32_t v = 0; v < sheet_.size(); ++v) sheet_[v] = v;
  std::vector<std::uint32_t> users(position_.size(), 0);
  for (const std::uint32_t p : place_) ++users[p];
  const auto root = [&](std::uint32_t v) {
    while (sheet_[v] != v) v = sheet_[v] = sheet_[sheet_[v]];
    return v;
  };

  // Edges by the places of their ends, where one of them has several vertices.
  struct Edge {
    std::uint32_t low, high;        // places
    std::uint32_t at_low, at_high;  // vertices
    auto key() const { return std::tie(low, high, at_low, at_high); }
  };
  std::vector<Edge> edges;
  for (const Triangle& t : scene_.triangle) {
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint32_t a = t.vertex[c], b = t.vertex[(c + 1) % 3];
      if (place_[b] < place_[a]) std::swap(a, b);
      if (users[place_[a]] + users[place_[b]] == 2) continue;
      edges.push_back({place_[a], place_[b], a, b});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.key() < b.key(); });
  const auto join = [&](std::uint32_t v, std::uint32_t w) {
    if (!(scene_.normal[v] == scene_.normal[w])) return;
    const std::uint32_t a = root(v), b = root(w);
    sheet_[std::max(a, b)] = std::min(a, b);
  };
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low &&
           edges[end].high == edges[begin].high) {
      ++end;
    }
    if (end - begin != 2) continue;
    join(edges[begin].at_low, edges[begin + 1].at_low);
    join(edges[begin].at_high, edges[begin + 1].at_high);
  }
  for (std::uint32_t v = 0; v < sheet_.size(); ++v) sheet_[v] = root(v);
}

Vec3 VertexSampler::centre(std::uint32_t triangle) const {
  const auto& v = scene_.triangle[triangle].vertex;
  return (1.0 / 3) * (position_[v[0]] + position_[v[1]] + position_[v[2]]);
}

// Unit, or nothing for a sliver whose corners coincide after rounding.
Vec3 VertexSampler::face_normal(std::uint32_t triangle) const {
  const auto& v = scene_.triangle[triangle].vertex;
  const Vec3 across = cross(position_[v[1]] - position_[v[0]], position_[v[2]] - position_[v[0]]);
  const double twice_area = length(across);
  return twice_area > 0 ? across * (1 / twice_area) : Vec3{};
}

Vec3 VertexSampler::origin(std::uint32_t vertex) const {
  const Vec3 p = position_[vertex];
  const Vec3 normal = scene_.normal[vertex];
  const std::uint32_t place = place_[vertex];
  const auto around =
      std::span(triangles_).subspan(first_[place], first_[place + 1] - first_[place]);
  const auto is_own = [&](std::uint32_t t) {
    const auto& v = scene_.triangle[t].vertex;
    const std::uint32_t sheet = sheet_[vertex];
    return sheet_[v[0]] == sheet || sheet_[v[1]] == sheet || sheet_[v[2]] == sheet;
  };

  // Its own triangles: their planes, their middle.
  std::vector<Vec3> planes;
  Vec3 middle, mean;
  int own = 0;
  for (const std::uint32_t t : around) {
    if (!is_own(t)) continue;
    const Vec3 n = face_normal(t);
    if (n == Vec3{}) continue;
    planes.push_back(dot(n, normal) < 0 ? -n : n);
    mean = mean + planes.back();
    middle = middle + (centre(t) - p);
    ++own;
  }
  if (own == 0) return p + Visibility::kSurfaceOffset * normal;
  middle = middle * (1.0 / own);
  mean = length(mean) > 1e-9 ? normalize(mean) : normal;
  const std::size_t own_planes = planes.size();

  // Neighbours that rise above them; their front is where the vertex's own triangles are.
  for (const std::uint32_t t : around) {
    if (is_own(t)) continue;
    const Vec3 n = face_normal(t), to = centre(t) - p;
    if (!(dot(to, mean) > kRises * length(to))) continue;
    const double side = dot(middle, n);
    if (std::abs(side) > kRises * length(middle)) planes.push_back(side < 0 ? -n : n);
  }

  const Vec3 inside = p + kInwards * (middle - dot(middle, normal) * normal);
  double least = 0;
  Vec3 off = away_from(planes, mean, least);
  if (least < kLeastCosine) {  // a cusp: its own planes alone, or none
    planes.resize(own_planes);
    off = away_from(planes, mean, least);
    if (least < kLeastCosine) return p + Visibility::kSurfaceOffset * normal;
  }
  double height = 0;
  for (const Vec3& n : planes) {
    const double above = dot(inside - p, n);
    height = std::max(height, (Visibility::kSurfaceOffset - above) / dot(n, off));
  }
  return inside + height * off;
}

VertexMaterial VertexSampler::material_at(std::uint32_t vertex) const {
  VertexMaterial hit;
  hit.material = material_[vertex] == kNone ? 0 : material_[vertex];
  const Material& material = scene_.material[hit.material];
  const auto texel = [&](int texture, const TextureMap& map) {
    const auto [u, v] = texture_place(scene_, vertex, map);
    return sample_texture(scene_.texture[static_cast<std::size_t>(texture)], u, v);
  };
  hit.albedo = material.albedo;
  if (material.texture >= 0) hit.albedo = hit.albedo * texel(material.texture, material.map);
  if (!scene_.tint.empty()) hit.albedo = hit.albedo * scene_.tint[vertex];
  hit.metallic = material.metallic, hit.roughness = material.roughness;
  if (material.metallic_roughness_texture >= 0) {
    const Rgb factor = texel(material.metallic_roughness_texture, material.metallic_roughness_map);
    hit.metallic *= factor.b, hit.roughness *= factor.g;
  }
  return hit;
}

std::vector<VertexMaterial> VertexSampler::materials() const {
  std::vector<VertexMaterial> all;
  for (std::uint32_t v = 0; v < material_.size(); ++v) all.push_back(material_at(v));
  return all;
}

Receiver VertexSampler::receiver(std::uint32_t vertex, std::uint32_t row) const {
  return receiver_at(vertex, row, origin(vertex));
}

Receiver VertexSampler::receiver_at(std::uint32_t vertex, std::uint32_t row,
                                    const Vec3& from) const {
  Receiver r;
  r.row = row;
  r.vertex = vertex;
  r.weight = {1, 1, 1};
  const Vec3 normal = scene_.normal[vertex];
  // What looks from a receiver moves off the surface along this normal; origin() already has.
  r.position = from - Visibility::kSurfaceOffset * normal;

  const VertexMaterial here = material_at(vertex);
  SurfaceHit hit;
  hit.position = r.position;
  hit.geometric_normal = hit.normal = hit.to_viewer = normal;
  hit.material = here.material;
  hit.albedo = here.albedo;
  hit.metallic = here.metallic, hit.roughness = here.roughness;
  r.bsdf = bsdf_at(scene_, hit);
  r.bsdf.geometric_normal = r.bsdf.normal = r.bsdf.to_viewer = normal;

  // The diffuse part alone, let out of its coat as on the mean over all views.
  r.bsdf.lobe = Bsdf::Lobe::none;
  r.bsdf.gloss_first = r.bsdf.gloss_second = {};
  r.bsdf.delta_count = 0;
  if (material_[vertex] == kNone) r.bsdf.diffuse_reflectance = {};
  if (r.bsdf.coat_f0 > 0 && r.bsdf.has_diffuse()) {
    const double straight =
        luminance(r.bsdf.diffuse_out(normal)) / luminance(r.bsdf.diffuse_reflectance);
    if (straight > 0) r.bsdf.diffuse_reflectance *= r.bsdf.coat_pass / straight;
  }
  return r;
}

// Makes of the diffuse receiver that of a term; false: the vertex has no such term.
bool VertexSampler::make_term(std::uint32_t vertex, int term, Receiver& r) const {
  const TermSet& set = terms_->set[terms_->set_of[vertex]];
  if (material_[vertex] == kNone || term >= set.terms()) return false;
  Bsdf& b = r.bsdf;
  if (set.diffuse_apart && term == 0) {
    if (b.coat_f0 > 0 && b.has_diffuse()) {  // what the coat lets out is in the outgoing factor
      b.diffuse_reflectance *= set.diffuse_scale / b.coat_pass;
    }
    return true;
  }
  b.coat_f0 = 0;
  b.diffuse_reflectance = {1, 1, 1};
  b.term = &set.incoming[static_cast<std::size_t>(term - (set.diffuse_apart ? 1 : 0))];
  r.weight = RgbD(terms_->lobe_tint[vertex]);
  return true;
}

ShadingPoint VertexSampler::point(std::uint32_t vertex) const {
  ShadingPoint p;
  const Vec3 from = origin(vertex);
  p.origin = {static_cast<float>(from.x), static_cast<float>(from.y), static_cast<float>(from.z)};
  p.geometric_normal = p.normal = scene_.normal[vertex];
  return p;
}

void VertexSampler::sample(std::span<const std::uint32_t> outputs, TileReceivers& tile) const {
  tile.clear();
  tile.coverage.assign(kTileRows, 0.0f);
  for (std::size_t row = 0; row < outputs.size(); ++row) {
    if (outputs[row] == kNoOutput) continue;
    tile.coverage[row] = 1;
    const auto count = static_cast<std::uint32_t>(terms());
    const std::uint32_t vertex = outputs[row] / count;
    // Rows of a vertex' terms are a block apart: what is found of one is kept for the next.
    const Receiver* same = nullptr;
    for (const Receiver& r : tile.receivers) {
      if (terms_ && r.vertex == vertex) same = &r;
    }
    const Vec3 from =
        same ? same->position + Visibility::kSurfaceOffset * scene_.normal[vertex] : origin(vertex);
    Receiver r = receiver_at(vertex, static_cast<std::uint32_t>(row), from);
    if (terms_ && !make_term(vertex, static_cast<int>(outputs[row] % count), r)) continue;
    tile.receivers.push_back(r);
  }
}

}  // namespace haarlight
