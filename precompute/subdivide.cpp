// Splits triangles where visibility changes.

#include "precompute/subdivide.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "precompute/direction_table.h"
#include "precompute/point_tracer.h"
#include "precompute/vertex_places.h"
#include "precompute/vertex_sampler.h"

namespace haarlight {
namespace {

constexpr int kFace = 8;
constexpr int kSamples = 4;
constexpr int kMostRounds = 200;
constexpr int kSlice = 64;

void check(const SubdivideOptions& o) {
  const auto refuse = [](const char* name, double value) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} is {}, expected a number above 0", name, value));
  };
  if (!(o.tolerance > 0)) refuse("subdivision tolerance", o.tolerance);
  if (!(o.longest > 0)) refuse("longest edge", o.longest);
  if (!(o.shortest > 0)) refuse("shortest edge", o.shortest);
}

double diameter(const Scene& scene) {
  Vec3 low = scene.position.at(0), high = low;
  for (const Vec3& p : scene.position) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return length(high - low);
}

using Pair = std::array<std::uint32_t, 2>;

Pair ordered(std::uint32_t a, std::uint32_t b) { return a < b ? Pair{a, b} : Pair{b, a}; }

// An edge between two places, whatever vertices stand there.
struct Edge {
  Pair places{};
  double length = 0;
  double difference = 0;
  std::uint32_t new_vertices = 0;  // if it is split
};

// Edges of a scene and the triangles at them.
struct Edges {
  explicit Edges(const Scene& scene);
  // Whether edge a is split before edge b where both are of one triangle.
  bool longer(std::uint32_t a, std::uint32_t b) const {
    const Edge &x = edge[a], &y = edge[b];
    return std::tie(y.length, x.places) < std::tie(x.length, y.places);
  }
  std::size_t longest(std::size_t triangle) const {
    std::size_t side = 0;
    for (std::size_t s = 1; s < 3; ++s) {
      if (longer(side_edge[triangle][s], side_edge[triangle][side])) side = s;
    }
    return side;
  }

  std::vector<Edge> edge;                               // ascending by places
  std::vector<std::array<std::uint32_t, 3>> side_edge;  // of each triangle; side s: corners s, s+1
  std::vector<std::uint32_t> first, triangles;          // triangles of each edge
};

Edges::Edges(const Scene& scene) {
  const std::vector<std::uint32_t> place = vertex_places(scene.position);
  struct Side {
    Pair places, vertices;
    std::uint32_t triangle, side;
  };
  std::vector<Side> sides;
  sides.reserve(3 * scene.triangle.size());
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const auto& v = scene.triangle[t].vertex;
    for (std::uint32_t s = 0; s < 3; ++s) {
      const std::uint32_t a = v[s], b = v[(s + 1) % 3];
      sides.push_back(
          {ordered(place[a], place[b]), ordered(a, b), static_cast<std::uint32_t>(t), s});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.places, a.vertices, a.triangle, a.side) <
           std::tie(b.places, b.vertices, b.triangle, b.side);
  });
  side_edge.resize(scene.triangle.size());
  triangles.reserve(sides.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Side& s = sides[i];
    const bool same = i > 0 && sides[i - 1].places == s.places;
    if (!same) {
      edge.push_back({s.places, length(scene.position[s.places[0]] - scene.position[s.places[1]])});
      first.push_back(static_cast<std::uint32_t>(i));
    }
    if (!same || sides[i - 1].vertices != s.vertices) ++edge.back().new_vertices;
    side_edge[s.triangle][s.side] = static_cast<std::uint32_t>(edge.size() - 1);
    triangles.push_back(s.triangle);
  }
  first.push_back(static_cast<std::uint32_t>(sides.size()));
}

// What vertices see, coarsely.
class Views {
 public:
  explicit Views(const Visibility& visibility)
      : visibility_(visibility), table_(kFace, kSamples), tracer_(visibility, table_, true) {}

  // Looks from the vertices that were not there before.
  void look(const Scene& scene) {
    const VertexSampler sampler(scene, visibility_);
    const std::size_t texels = table_.texels(), old = share_.size() / texels;
    share_.resize(texels * scene.position.size());
    const int count = static_cast<int>(scene.position.size() - old);
    std::mutex mutex;
    std::vector<Work> free;
    parallel_for((count + kSlice - 1) / kSlice, [&](int slice) {
      Work work;
      {
        const std::lock_guard lock(mutex);
        if (!free.empty()) {
          work = std::move(free.back());
          free.pop_back();
        }
      }
      work.lambert.resize(texels);
      for (int i = slice * kSlice; i < std::min(count, (slice + 1) * kSlice); ++i) {
        const auto v = static_cast<std::uint32_t>(old + static_cast<std::size_t>(i));
        tracer_.trace(sampler.point(v), work.lambert, {}, work.scratch, work.counts);
        for (std::size_t k = 0; k < texels; ++k) {
          const float all = open(scene.normal[v], k);
          const float share = all > 0 ? std::min(work.lambert[k] / all, 1.0f) : 0.0f;
          share_[v * texels + k] = static_cast<std::uint8_t>(std::lround(255 * share));
        }
      }
      const std::lock_guard lock(mutex);
      free.push_back(std::move(work));
    });
  }

  // How different what two vertices see is, in shares of the irradiance of an even sky: over
  // texels above both horizons, so that a surface that bends is no difference.
  double difference(const Scene& scene, std::uint32_t a, std::uint32_t b) const {
    const std::size_t texels = table_.texels();
    const std::uint8_t *x = share_.data() + a * texels, *y = share_.data() + b * texels;
    double sum = 0;
    for (std::size_t k = 0; k < texels; ++k) {
      if (x[k] == y[k]) continue;
      const float u = open(scene.normal[a], k), v = open(scene.normal[b], k);
      if (u <= 0 || v <= 0) continue;
      sum += std::abs(static_cast<double>(x[k]) - static_cast<double>(y[k])) / 255 *
             static_cast<double>(std::min(u, v));
    }
    return sum;
  }

 private:
  struct Work {
    std::vector<float> lambert;
    PointScratch scratch;
    RayCounts counts;
  };
  // Irradiance over pi that texel k gives when nothing blocks it.
  float open(const Vec3& n, std::size_t k) const {
    return static_cast<float>(n.x / kPi) * table_.moment_x[k] +
           static_cast<float>(n.y / kPi) * table_.moment_y[k] +
           static_cast<float>(n.z / kPi) * table_.moment_z[k];
  }

  const Visibility& visibility_;
  DirectionTable table_;
  PointTracer tracer_;
  std::vector<std::uint8_t> share_;  // [vertex][texel]
};

// `wanted` and every edge that has to be split with them: longest ones of triangles come first.
std::vector<bool> with_longest(const Edges& edges, std::span<const std::uint32_t> wanted) {
  std::vector<bool> marked(edges.edge.size(), false);
  std::vector<std::uint32_t> open;
  const auto mark = [&](std::uint32_t e) {
    if (!marked[e]) {
      marked[e] = true;
      open.push_back(e);
    }
  };
  for (const std::uint32_t e : wanted) mark(e);
  while (!open.empty()) {
    const std::uint32_t e = open.back();
    open.pop_back();
    for (std::uint32_t i = edges.first[e]; i < edges.first[e + 1]; ++i) {
      const std::uint32_t t = edges.triangles[i];
      mark(edges.side_edge[t][edges.longest(t)]);
    }
  }
  return marked;
}

std::int64_t new_vertices(const Edges& edges, const std::vector<bool>& marked) {
  std::int64_t count = 0;
  for (std::size_t e = 0; e < marked.size(); ++e) {
    if (marked[e]) count += edges.edge[e].new_vertices;
  }
  return count;
}

// The marked edges that fit into `budget` new vertices: as many of `wanted`, which begins with the
// worst, as halving their number finds room for. Empty: none.
std::vector<bool> fitting(const Edges& edges, std::span<const std::uint32_t> wanted,
                          std::int64_t budget) {
  for (std::size_t count = wanted.size(); count > 0; count /= 2) {
    std::vector<bool> marked = with_longest(edges, wanted.first(count));
    if (new_vertices(edges, marked) <= budget) return marked;
  }
  return {};
}

void add_middle(Scene& scene, std::uint32_t a, std::uint32_t b) {
  scene.position.push_back(0.5 * (scene.position[a] + scene.position[b]));
  const Vec3 normal = scene.normal[a] + scene.normal[b];
  scene.normal.push_back(length(normal) > 1e-6 ? normalize(normal) : scene.normal[a]);
  for (auto* uv : {&scene.uv, &scene.uv2}) {
    if (uv->empty()) continue;
    const auto u = (*uv)[a], v = (*uv)[b];
    uv->push_back({0.5f * (u[0] + v[0]), 0.5f * (u[1] + v[1])});
  }
  if (!scene.tint.empty()) scene.tint.push_back(0.5f * (scene.tint[a] + scene.tint[b]));
}

void split(Scene& scene, const Edges& edges, const std::vector<bool>& marked) {
  // A new vertex for each pair of vertices at the ends of a marked edge, in the order of pairs.
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const auto& v = scene.triangle[t].vertex;
    for (std::size_t s = 0; s < 3; ++s) {
      if (marked[edges.side_edge[t][s]]) pairs.push_back(ordered(v[s], v[(s + 1) % 3]));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const auto old = static_cast<std::uint32_t>(scene.position.size());
  for (const Pair& p : pairs) add_middle(scene, p[0], p[1]);
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto at = std::lower_bound(pairs.begin(), pairs.end(), ordered(a, b));
    return old + static_cast<std::uint32_t>(at - pairs.begin());
  };

  std::vector<Triangle> finer;
  finer.reserve(scene.triangle.size() + 2 * pairs.size());
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const Triangle& triangle = scene.triangle[t];
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      finer.push_back({{a, b, c}, triangle.material});
    };
    // Its longest side, from a to b, is split first; c is the corner opposite.
    const std::size_t s = edges.longest(t);
    const auto is_marked = [&](std::size_t side) { return marked[edges.side_edge[t][side % 3]]; };
    if (!is_marked(s)) {
      finer.push_back(triangle);
      continue;
    }
    const std::uint32_t a = triangle.vertex[s], b = triangle.vertex[(s + 1) % 3],
                        c = triangle.vertex[(s + 2) % 3], m = middle(a, b);
    if (is_marked(s + 2)) {
      const std::uint32_t ca = middle(c, a);
      add(a, m, ca), add(ca, m, c);
    } else {
      add(a, m, c);
    }
    if (is_marked(s + 1)) {
      const std::uint32_t bc = middle(b, c);
      add(m, b, bc), add(m, bc, c);
    } else {
      add(m, b, c);
    }
  }
  scene.triangle = std::move(finer);
}

}  // namespace

Scene subdivide(const Scene& scene, const Visibility& visibility, const SubdivideOptions& options,
                SubdivideReport* report, const Progress& progress) {
  check(options);
  Scene finer = scene;
  SubdivideReport said;
  const double size = diameter(scene);
  Views views(visibility);
  bool even = false;  // no edge is too long any more
  for (; said.rounds < kMostRounds; ++said.rounds) {
    const auto vertices = static_cast<std::int64_t>(finer.position.size());
    const double share =
        std::min(1.0, static_cast<double>(vertices) / static_cast<double>(options.max_vertices));
    if (progress && !progress(share)) {
      throw Error(ErrorKind::cancelled, "subdivision stopped by its caller");
    }
    Edges edges(finer);
    std::vector<std::uint32_t> wanted;
    std::vector<double> worth(edges.edge.size(), 0.0);
    const std::int64_t budget = options.max_vertices - vertices;
    if (!even) {
      for (std::uint32_t e = 0; e < edges.edge.size(); ++e) {
        if (edges.edge[e].length > options.longest * size) worth[e] = edges.edge[e].length;
      }
    }
    const auto take = [&](double least) {
      wanted.clear();
      for (std::uint32_t e = 0; e < worth.size(); ++e) {
        if (worth[e] > least) wanted.push_back(e);
      }
      std::sort(wanted.begin(), wanted.end(), [&](std::uint32_t a, std::uint32_t b) {
        return worth[a] != worth[b] ? worth[a] > worth[b] : a < b;
      });
    };
    take(0);
    if (wanted.empty()) {
      even = true;
      views.look(finer);
      // The worst pair of vertices of each edge.
      parallel_for(
          static_cast<int>(edges.edge.size()),
          [&](int i) {
            const auto e = static_cast<std::uint32_t>(i);
            Edge& edge = edges.edge[e];
            if (edge.length <= options.shortest * size) return;
            for (std::uint32_t j = edges.first[e]; j < edges.first[e + 1]; ++j) {
              const std::uint32_t t = edges.triangles[j];
              for (std::size_t s = 0; s < 3; ++s) {
                if (edges.side_edge[t][s] != e) continue;
                const auto& v = finer.triangle[t].vertex;
                edge.difference =
                    std::max(edge.difference, views.difference(finer, v[s], v[(s + 1) % 3]));
              }
            }
          },
          kSlice);
      double worst = 0;
      said.worst = 0;
      for (std::uint32_t e = 0; e < worth.size(); ++e) {
        said.worst = std::max(said.worst, edges.edge[e].difference);
        if (edges.edge[e].difference <= options.tolerance) continue;
        worth[e] = edges.edge[e].difference * edges.edge[e].length;
        worst = std::max(worst, worth[e]);
      }
      take(0.5 * worst);
    }
    if (wanted.empty() || budget <= 0) break;
    const std::vector<bool> marked = fitting(edges, wanted, budget);
    if (marked.empty()) {
      if (even) break;
      even = true;
      continue;
    }
    said.split_edges += std::count(marked.begin(), marked.end(), true);
    split(finer, edges, marked);
  }
  said.vertices = static_cast<std::int64_t>(finer.position.size());
  said.triangles = static_cast<std::int64_t>(finer.triangle.size());
  if (report) *report = said;
  return finer;
}

}  // namespace haarlight
