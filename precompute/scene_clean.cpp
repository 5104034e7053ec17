// Mending a scene as files bring it: broken triangles out, normals in, vertices welded.

#include "precompute/scene_clean.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

#include "core/error.h"

namespace haarlight {
namespace {

const double kCreaseCosine = 0.5;  // 60 degrees

// Room for the squares and sums of single precision's users.
constexpr double kFarthest = 1e37;
// Of the size of the scene: about what single precision tells apart there.
constexpr double kTiny = 1e-7;

bool finite(const Vec3& v) {
  return std::abs(v.x) <= kFarthest && std::abs(v.y) <= kFarthest && std::abs(v.z) <= kFarthest;
}

// Any fixed number of plain values as a key: equal bytes are equal keys (no padding, no -0).
template <std::size_t N>
struct Key {
  std::array<double, N> value;
  friend bool operator==(const Key&, const Key&) = default;
};
template <std::size_t N>
struct KeyHash {
  std::size_t operator()(const Key<N>& key) const {
    return std::hash<std::string_view>{}(
        {reinterpret_cast<const char*>(key.value.data()), sizeof(double) * N});
  }
};
template <std::size_t N>
using KeyIndex = std::unordered_map<Key<N>, std::uint32_t, KeyHash<N>>;

void check_indices(const Scene& scene) {
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const Triangle& triangle = scene.triangle[t];
    for (const std::uint32_t v : triangle.vertex) {
      if (v >= scene.position.size()) {
        throw Error(ErrorKind::format,
                    fmt::format("{}: triangle {} names vertex {}, expected below {}", scene.name, t,
                                v, scene.position.size()));
      }
    }
    if (triangle.material >= scene.material.size()) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: triangle {} names material {}, expected below {}", scene.name, t,
                              triangle.material, scene.material.size()));
    }
  }
}

// Per vertex, the number of its place: vertices at the same place share it.
std::vector<std::uint32_t> number_places(const Scene& scene) {
  KeyIndex<3> places;
  places.reserve(scene.position.size());
  std::vector<std::uint32_t> place(scene.position.size());
  for (std::size_t v = 0; v < place.size(); ++v) {
    const Vec3& p = scene.position[v];
    const Key<3> key{{p.x + 0.0, p.y + 0.0, p.z + 0.0}};  // -0 + 0 is +0
    place[v] = places.try_emplace(key, static_cast<std::uint32_t>(places.size())).first->second;
  }
  return place;
}

bool has_area(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, bc = c - b;
  const double longest = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
  return length(cross(ab, ac)) > 1e-12 * longest;
}

void drop_broken(Scene& scene, const std::vector<std::uint32_t>& place) {
  std::vector<Triangle> kept;
  kept.reserve(scene.triangle.size());
  std::unordered_set<Key<3>, KeyHash<3>> seen;
  seen.reserve(scene.triangle.size());
  for (const Triangle& t : scene.triangle) {
    const Vec3 &a = scene.position[t.vertex[0]], &b = scene.position[t.vertex[1]],
               &c = scene.position[t.vertex[2]];
    if (!finite(a) || !finite(b) || !finite(c)) {
      ++scene.report.dropped_not_finite;
      continue;
    }
    if (!has_area(a, b, c)) {
      ++scene.report.dropped_degenerate;
      continue;
    }
    std::array<std::uint32_t, 3> corners{place[t.vertex[0]], place[t.vertex[1]],
                                         place[t.vertex[2]]};
    std::sort(corners.begin(), corners.end());
    const Key<3> key{{static_cast<double>(corners[0]), static_cast<double>(corners[1]),
                      static_cast<double>(corners[2])}};
    if (!seen.insert(key).second) {
      ++scene.report.dropped_duplicate;
      continue;
    }
    kept.push_back(t);
  }
  scene.triangle = std::move(kept);
}

// Counts what is left so but may surprise; see SceneReport.
void count_oddities(Scene& scene) {
  Vec3 low = scene.position[scene.triangle.front().vertex[0]], high = low;
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      const Vec3& p = scene.position[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  const double tiny = kTiny * std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  for (const Triangle& t : scene.triangle) {
    const Vec3& a = scene.position[t.vertex[0]];
    const Vec3 ab = scene.position[t.vertex[1]] - a, ac = scene.position[t.vertex[2]] - a;
    if (std::max(length(ab), length(ac)) < tiny) ++scene.report.tiny;
    const Vec3 face = cross(ab, ac);
    scene.report.against_normals +=
        std::all_of(t.vertex.begin(), t.vertex.end(),
                    [&](std::uint32_t v) { return dot(scene.normal[v], face) < 0; });
  }
}

// Faces around every place, as ranges of one array.
struct Faces {
  std::vector<std::size_t> begin;  // of place p: [begin[p], begin[p + 1])
  struct Around {
    std::uint32_t triangle;
    double angle;  // radians, of the triangle at the place
  };
  std::vector<Around> around;
  std::vector<Vec3> normal;  // unit, one a triangle
};

Faces faces_around(const Scene& scene, const std::vector<std::uint32_t>& place) {
  Faces faces;
  const std::uint32_t places =
      place.empty() ? 0 : *std::max_element(place.begin(), place.end()) + 1;
  faces.begin.assign(std::size_t{places} + 1, 0);
  faces.normal.reserve(scene.triangle.size());
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) ++faces.begin[place[v] + 1];
    const Vec3& a = scene.position[t.vertex[0]];
    faces.normal.push_back(
        normalize(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a)));
  }
  for (std::size_t p = 0; p < places; ++p) faces.begin[p + 1] += faces.begin[p];
  std::vector<std::size_t> next(faces.begin.begin(), faces.begin.end() - 1);
  faces.around.resize(3 * scene.triangle.size());
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const auto& vertex = scene.triangle[t].vertex;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3& here = scene.position[vertex[c]];
      const Vec3 ab = scene.position[vertex[(c + 1) % 3]] - here;
      const Vec3 ac = scene.position[vertex[(c + 2) % 3]] - here;
      faces.around[next[place[vertex[c]]]++] = {static_cast<std::uint32_t>(t),
                                                std::atan2(length(cross(ab, ac)), dot(ab, ac))};
    }
  }
  return faces;
}

// The normal of one corner; see the header.
Vec3 smooth_normal(const Faces& faces, std::size_t place, std::size_t triangle) {
  // The tip of a fan with thousands of faces would cost their square; it has no smooth normal.
  constexpr std::size_t kMostFaces = 512;
  const Vec3& own = faces.normal[triangle];
  const std::size_t begin = faces.begin[place], end = faces.begin[place + 1];
  if (end - begin > kMostFaces) return own;
  Vec3 sum;
  double votes = 0;  // that `own` faces as most of them do
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3& other = faces.normal[faces.around[i].triangle];
    const double cosine = dot(own, other);
    if (std::abs(cosine) < kCreaseCosine) continue;
    const double angle = cosine < 0 ? -faces.around[i].angle : faces.around[i].angle;
    sum = sum + other * angle;
    votes += angle;
  }
  // Each term is within 60 degrees of `own`: the sum is not zero. A single face that is wound the
  // wrong way would make its vertices look into the body, and black.
  return normalize(votes < 0 ? -sum : sum);
}

// Writes the triangles anew over vertices that are used, whole and different from each other.
void rebuild_vertices(Scene& scene, const std::vector<std::uint32_t>& place) {
  const std::size_t old_count = scene.position.size();
  std::vector<bool> bad(old_count, false);
  for (std::size_t v = 0; v < old_count; ++v) {
    const bool there = v < scene.normal.size() && finite(scene.normal[v]);
    const double size = there ? length(scene.normal[v]) : 0;
    bad[v] = !(size > 0) || !std::isfinite(size);
    if (!bad[v]) scene.normal[v] = scene.normal[v] * (1 / size);
  }
  const Faces faces = faces_around(scene, place);

  Scene fresh;
  KeyIndex<13> index;
  index.reserve(old_count);
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    for (std::uint32_t& v : scene.triangle[t].vertex) {
      const std::size_t old = v;
      Vec3 normal;
      if (bad[old]) {
        normal = smooth_normal(faces, place[old], t);
      } else {
        normal = scene.normal[old];
      }
      std::array<float, 2> uv{};
      if (old < scene.uv.size()) uv = scene.uv[old];
      std::array<float, 2> uv2{};
      if (old < scene.uv2.size()) uv2 = scene.uv2[old];
      Rgb tint{1, 1, 1};
      if (old < scene.tint.size()) tint = scene.tint[old];
      const Vec3& p = scene.position[old];
      const Key<13> key{{p.x + 0.0, p.y + 0.0, p.z + 0.0, normal.x + 0.0, normal.y + 0.0,
                         normal.z + 0.0, static_cast<double>(uv[0]) + 0.0,
                         static_cast<double>(uv[1]) + 0.0, static_cast<double>(tint.r) + 0.0,
                         static_cast<double>(tint.g) + 0.0, static_cast<double>(tint.b) + 0.0,
                         static_cast<double>(uv2[0]) + 0.0, static_cast<double>(uv2[1]) + 0.0}};
      const auto [at, is_new] =
          index.try_emplace(key, static_cast<std::uint32_t>(fresh.position.size()));
      if (is_new) {
        fresh.position.push_back(p);
        fresh.normal.push_back(normal);
        fresh.uv.push_back(uv);
        if (!scene.uv2.empty()) fresh.uv2.push_back(uv2);
        if (!scene.tint.empty()) fresh.tint.push_back(tint);
        if (bad[old]) ++scene.report.normals_made;
      }
      v = at->second;
    }
  }
  scene.position = std::move(fresh.position);
  scene.normal = std::move(fresh.normal);
  scene.uv = std::move(fresh.uv);
  scene.uv2 = std::move(fresh.uv2);
  scene.tint = std::move(fresh.tint);
}

}  // namespace

void clean_scene(Scene& scene) {
  check_indices(scene);
  std::vector<bool> used(scene.position.size(), false);
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) used[v] = true;
  }
  scene.report.unused_vertices += std::count(used.begin(), used.end(), false);

  const std::vector<std::uint32_t> place = number_places(scene);
  const std::size_t before = scene.triangle.size();
  drop_broken(scene, place);
  if (scene.triangle.empty()) {
    throw Error(ErrorKind::missing,
                before == 0 ? fmt::format("{}: no triangles, expected at least one", scene.name)
                            : fmt::format("{}: none of {} triangles has finite corners and an "
                                          "area, expected at least one",
                                          scene.name, before));
  }
  rebuild_vertices(scene, place);
  count_oddities(scene);
}

}  // namespace haarlight
