// Rows 29 to 35: broken and doubled geometry, rays that start on surfaces, scale, leaks.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "precompute/point_tracer.h"
#include "precompute/precompute.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene_clean.h"
#include "precompute/surface.h"
#include "precompute/vertex_sampler.h"
#include "prt/transport.h"
#include "tests/core/temporary_folder.h"
#include "tests/hard/hard_case.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

using namespace hard;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Columns, row tables and coverage that differ between two transports.
double differences(const Transport& a, const Transport& b) {
  if (a.rows() != b.rows() || a.chunk_count() != b.chunk_count()) return HUGE_VAL;
  double different = 0;
  for (int chunk = 0; chunk < a.chunk_count(); ++chunk) {
    for (int w = 0; w < 4; ++w) different += a.rgb_blocks(chunk)[w] != b.rgb_blocks(chunk)[w];
    for (int j = 0; j < a.layout().size(); ++j) {
      const ColumnBlocks p = a.column(chunk, j), q = b.column(chunk, j);
      different += p.bytes != q.bytes || (p.bytes && std::memcmp(p.present, q.present, p.bytes));
    }
  }
  for (std::size_t i = 0; i < a.row_output().size(); ++i) {
    different += a.row_output()[i] != b.row_output()[i] || !(a.row_color()[i] == b.row_color()[i]);
  }
  for (std::size_t i = 0; i < a.coverage().size(); ++i)
    different += a.coverage()[i] != b.coverage()[i];
  return different;
}

Transport picture_of(const Scene& scene, const Camera& camera, const Effects& effects) {
  const TemporaryFolder folder;
  PrecomputeOptions options;
  options.trace.face_size = 8;
  options.trace.indirect_face = 8;
  options.trace.paths = 64;
  options.trace.effects = effects;
  precompute_image(scene, camera, options, folder / "a.hlt");
  return Transport::open(folder / "a.hlt");  // stays mapped when its name is gone
}

Transport mesh_of(const Scene& scene, const Camera& camera) {
  const TemporaryFolder folder;
  MeshOptions options;
  options.trace.face_size = 8;
  options.max_vertices = 3000;
  precompute_mesh(scene, camera, options, folder / "a.hlt");
  return Transport::open(folder / "a.hlt");
}

// A ball over the ground beside a box: shadows, a contact, two colours.
Scene still_life() {
  Scene scene = shapes::empty_scene();
  scene.material[0].albedo = {0.6f, 0.5f, 0.4f};
  scene.material.push_back(scene.material[0]);
  scene.material[1].albedo = {0.2f, 0.6f, 0.7f};
  scene.material[1].specular = {0.3f, 0.3f, 0.3f};
  shapes::add_quad(scene, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
  shapes::add_sphere(scene, {0.1, 0.8, 0}, 0.4, 3, 1);
  shapes::add_box(scene, {0.6, 0, 0.2}, {1, 0.5, 0.7});
  return scene;
}

Camera still_life_camera(double scale = 1) {
  return look_at(Vec3{0.5, 2, 3} * scale, Vec3{0, 0.3, 0} * scale, 0.8, 24, 16);
}

// A direction of the sphere, even.
template <typename Random>
Vec3 direction_of(Random& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  for (;;) {
    const Vec3 d{unit(random), unit(random), unit(random)};
    const double s = dot(d, d);
    if (s > 0.01 && s <= 1) return d * (1 / std::sqrt(s));
  }
}

struct Packet {
  alignas(32) float x[8], y[8], z[8];
  void set(int i, const Vec3& d) {
    x[i] = static_cast<float>(d.x), y[i] = static_cast<float>(d.y), z[i] = static_cast<float>(d.z);
  }
};

std::array<float, 3> to_float(const Vec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

// Share of an even sky that a point sees, over pi.
double irradiance(const PointTracer& tracer, const ShadingPoint& point) {
  std::vector<float> lambert(tracer.table().texels());
  PointScratch scratch;
  RayCounts counts;
  tracer.trace(point, lambert, {}, scratch, counts);
  double sum = 0;
  for (const float l : lambert) sum += static_cast<double>(l);
  return sum;
}

TEST(HardCases, Row29_BrokenTriangles) {
  property("zero-area, NaN and doubled triangles: T is that of the clean mesh, drops are counted");
  Scene clean = still_life();
  Scene broken = clean;
  const auto vertex = [&](const Vec3& p) { return shapes::add_vertex(broken, p, {0, 1, 0}); };
  const std::uint32_t nan = vertex({kNan, 0, 0}), far = vertex({0, HUGE_VAL, 1});
  const std::uint32_t a = vertex({0.3, 0.2, 0.1}), b = vertex({0.5, 0.2, 0.1}),
                      c = vertex({0.4, 0.2, 0.1});  // on a line
  std::vector<Triangle> wrong = {
      {{a, b, c}, 0}, {{a, a, b}, 0}, {{nan, a, b}, 0}, {{a, far, b}, 1}, {{a, c, c}, 0}};
  const std::vector<Triangle> whole = broken.triangle;
  for (int i = 0; i < 7; ++i) {  // the same corners, turned, and wound the other way
    const Triangle& t = whole[static_cast<std::size_t>(i * 11)];
    wrong.push_back({{t.vertex[1], t.vertex[2], t.vertex[0]}, t.material});
    wrong.push_back({{t.vertex[0], t.vertex[2], t.vertex[1]}, t.material});
  }
  broken.triangle.insert(broken.triangle.end(), wrong.begin(), wrong.end());
  clean_scene(clean);
  clean_scene(broken);
  const SceneReport& report = broken.report;
  const double miscounted = std::abs(static_cast<double>(report.dropped_degenerate) - 3) +
                            std::abs(static_cast<double>(report.dropped_not_finite) - 2) +
                            std::abs(static_cast<double>(report.dropped_duplicate) - 14);
  at_most("drops miscounted", miscounted, 0);
  const Camera camera = still_life_camera();
  at_most("picture: columns that differ",
          differences(picture_of(clean, camera, {}), picture_of(broken, camera, {})), 0);
  at_most("mesh: columns that differ", differences(mesh_of(clean, camera), mesh_of(broken, camera)),
          0);
}

TEST(HardCases, Row30_EqualPlacesHaveEqualRows) {
  property(
      "vertices of one place and normal on one surface have one row; doubled faces change none");
  // A ball whose triangles all have corners of their own, as a file with a texture seam has them,
  // over a ground cut into two quads.
  Scene welded = shapes::empty_scene();
  shapes::add_sphere(welded, {0.1, 0.9, 0}, 0.4, 3);
  shapes::add_quad(welded, {-2, 0, -2}, {0, 0, 4}, {2, 0, 0});
  shapes::add_quad(welded, {0, 0, -2}, {0, 0, 4}, {2, 0, 0});
  Scene split = welded;
  split.position.clear(), split.normal.clear(), split.uv.clear(), split.triangle.clear();
  for (const Triangle& t : welded.triangle) {
    Triangle own = t;
    for (std::uint32_t& v : own.vertex) {
      v = shapes::add_vertex(split, welded.position[v], welded.normal[v]);
    }
    split.triangle.push_back(own);
  }
  const Visibility visibility(split);
  const DirectionTable table(8, 4);
  const PointTracer tracer(visibility, table, true);
  const VertexSampler sampler(split, visibility);
  std::vector<std::vector<float>> rows;
  for (std::uint32_t v = 0; v < split.position.size(); ++v) {
    rows.emplace_back(table.texels());
    PointScratch scratch;
    RayCounts counts;
    tracer.trace(sampler.point(v), rows.back(), {}, scratch, counts);
  }
  double pairs = 0, different = 0;
  for (std::size_t v = 0; v < rows.size(); ++v) {
    for (std::size_t w = v + 1; w < rows.size(); ++w) {
      if (!(split.position[v] == split.position[w]) || !(split.normal[v] == split.normal[w])) {
        continue;
      }
      ++pairs;
      different += rows[v] != rows[w];
    }
  }
  at_least("pairs of equal vertices", pairs, 1000);
  at_most("pairs whose rows differ", different, 0);

  // Faces that lie in each other, with any winding, change no bit of a picture.
  Scene doubled = still_life();
  const Transport once = picture_of(doubled, still_life_camera(), {});
  shapes::add_quad(doubled, {-2, 0, -2}, {4, 0, 0}, {0, 0, 4});
  shapes::add_quad(doubled, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
  // Which of the equal faces a pixel's ray reports is left open; the bits must not depend on it.
  at_most("picture with doubled faces: columns that differ",
          differences(once, picture_of(doubled, still_life_camera(), {})), 0);
}

TEST(HardCases, Row31_SelfShadowing) {
  property("rays that leave a convex body never meet it: 0 of 10^7, wherever it stands");
  Scene sphere = shapes::empty_scene();
  shapes::add_sphere(sphere, {0.1, 0.2, 0.3}, 0.7, 6);
  Scene needle = shapes::empty_scene();
  shapes::add_box(needle, {0, 0, 0}, {1, 1e-3, 3e-3});
  double rays = 0, blocked = 0;
  for (const Scene& scene :
       {sphere, shapes::moved(sphere, 1, {1e5, -1e5, 1e5}),
        shapes::moved(sphere, 1e-4, {2e3, 0, 0}), shapes::moved(sphere, 1e6, {}), needle,
        shapes::moved(needle, 1, {2e3, 2e3, 2e3})}) {
    const Visibility visibility(scene);
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int i = 0; i < 210000; ++i) {
      const auto t = static_cast<std::uint32_t>(random() % visibility.triangle_count());
      double b1 = unit(random), b2 = unit(random);
      if (b1 + b2 > 1) b1 = 1 - b1, b2 = 1 - b2;
      const Vec3 a = visibility.corner(t, 0), b = visibility.corner(t, 1),
                 c = visibility.corner(t, 2);
      const Vec3 across = cross(b - a, c - a);
      if (!(length(across) > 0)) continue;  // a sliver that far out floats cannot tell from a line
      const Vec3 normal = normalize(across);
      Receiver receiver;
      receiver.position = a * (1 - b1 - b2) + b * b1 + c * b2;
      receiver.bsdf.geometric_normal = receiver.bsdf.normal = receiver.bsdf.to_viewer = normal;
      const ShadingPoint point = shading_point(receiver);
      Packet packet;
      for (int lane = 0; lane < 8; ++lane) {
        Vec3 d = direction_of(random);
        if (dot(d, normal) < 0) d = -d;
        if (lane % 2 == 0) d = normalize(d - 0.999 * dot(d, normal) * normal);  // grazing
        packet.set(lane, d);
      }
      blocked +=
          std::popcount(visibility.occluded8(point.origin, packet.x, packet.y, packet.z, 0xff));
      rays += 8;
    }
  }
  at_least("rays", rays, 9.9e6);
  at_most("rays blocked", blocked, 0);
}

TEST(HardCases, Row32_Scale) {
  property("a scene 2^20 times as large or small has the same transport, bit for bit");
  const Scene scene = still_life();
  Effects bounced;
  bounced.bounces = 2;
  const Transport direct = picture_of(scene, still_life_camera(), {});
  const Transport indirect = picture_of(scene, still_life_camera(), bounced);
  const Transport vertices = mesh_of(scene, still_life_camera());
  double different = 0;
  for (const int exponent : {-20, 20}) {
    const double scale = std::ldexp(1.0, exponent);
    const Scene other = shapes::moved(scene, scale, {});
    different += differences(direct, picture_of(other, still_life_camera(scale), {}));
    different += differences(indirect, picture_of(other, still_life_camera(scale), bounced));
    different += differences(vertices, mesh_of(other, still_life_camera(scale)));
  }
  at_most("columns that differ", different, 0);
}

TEST(HardCases, Row33_Leaks) {
  property("from inside a closed room at most 2e-5 of rays get out, wherever the room stands");
  // Every other ray is aimed at an edge, where two triangles might leave each other a gap; not at
  // its ends, which are row 34's.
  Scene ball = shapes::empty_scene();
  shapes::add_sphere(ball, {}, 1, 5);
  double rays = 0, leaked = 0;
  for (const Vec3& by : {Vec3{}, Vec3{148376, -148376, 98000}, Vec3{0, 2e6, 0}}) {
    const Scene there = shapes::moved(ball, 1, by);
    const Visibility visibility(there);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> place(-0.5, 0.5), along(0.05, 0.95);
    for (int i = 0; i < 170000; ++i) {
      Packet packet;
      const Vec3 from{place(random), place(random), place(random)};
      const auto origin = to_float(from);
      for (int lane = 0; lane < 8; ++lane) {
        Vec3 d = direction_of(random);
        if (lane % 2) {
          const auto t = static_cast<std::uint32_t>(random() % visibility.triangle_count());
          const int c = static_cast<int>(random() % 3);
          const double share = along(random);
          d = normalize(visibility.corner(t, c) * share +
                        visibility.corner(t, (c + 1) % 3) * (1 - share) - from);
        }
        packet.set(lane, d);
      }
      leaked += 8 - std::popcount(visibility.occluded8(origin, packet.x, packet.y, packet.z, 0xff));
      rays += 8;
    }
  }
  at_least("rays", rays, 4e6);
  at_most("share that gets out", leaked / rays, 2e-5);
}

// A closed cube around the origin whose walls have vertices on a grid of `cells` x `cells` squares.
Scene gridded_room(int cells) {
  Scene scene = shapes::empty_scene();
  const double step = 2.0 / cells;
  const auto wall = [&](const Vec3& corner, const Vec3& a, const Vec3& b) {
    for (int j = 0; j < cells; ++j) {
      for (int i = 0; i < cells; ++i) {
        shapes::add_quad(scene, corner + a * (i * step) + b * (j * step), a * step, b * step);
      }
    }
  };
  wall({-1, -1, -1}, {1, 0, 0}, {0, 1, 0});
  wall({-1, -1, 1}, {0, 1, 0}, {1, 0, 0});
  wall({-1, -1, -1}, {0, 0, 1}, {1, 0, 0});
  wall({-1, 1, -1}, {1, 0, 0}, {0, 0, 1});
  wall({-1, -1, -1}, {0, 1, 0}, {0, 0, 1});
  wall({1, -1, -1}, {0, 0, 1}, {0, 1, 0});
  return scene;
}

TEST(HardCases, Row34_RaysAtVertices) {
  property("a closed room whose vertices lie where texels' middles, corners point: light <= 2e-5");
  // Even robust intersection loses rays that go exactly through a vertex. From the middle of the
  // cube the texels' middles and corners are vertices of the wall; rays must not be aimed at them.
  double most = 0, texels = 0;
  for (const int cells : {16, 32, 64}) {
    const Scene scene = gridded_room(cells);
    const Visibility visibility(scene);
    for (const int samples : {1, 4, 16}) {
      const DirectionTable table(16, samples);
      for (const bool adaptive : {true, false}) {
        const PointTracer tracer(visibility, table, adaptive);
        for (const Vec3& normal : {Vec3{0, 1, 0}, Vec3{1, 0, 0}, normalize(Vec3{1, 1, 1})}) {
          ShadingPoint point;
          point.geometric_normal = point.normal = normal;
          most = std::max(most, irradiance(tracer, point));
          texels += static_cast<double>(table.texels()) / 2;
        }
      }
    }
  }
  // The same seen from where nothing is a round number: walls of any distance, a place off the
  // middle of the scene.
  for (const int cells : {16, 32, 64}) {
    for (int shape = 0; shape < 4; ++shape) {
      Scene scene = gridded_room(cells);
      const Vec3 middle{0.31 + shape, -0.27, 0.13 * shape};
      for (Vec3& p : scene.position) {
        const double far = 1 + 0.4 * std::sin(7.3 * p.x + 3 * shape) * std::cos(5.9 * p.y - p.z);
        p = middle + far * p;
      }
      const Visibility visibility(scene);
      for (const int samples : {1, 4, 16}) {
        const DirectionTable table(16, samples);
        const PointTracer tracer(visibility, table, false);
        for (const Vec3& normal : {Vec3{0, 1, 0}, Vec3{1, 0, 0}, normalize(Vec3{1, 1, 1})}) {
          ShadingPoint point;
          const Vec3 at = visibility.to_local(middle);
          point.origin = {static_cast<float>(at.x), static_cast<float>(at.y),
                          static_cast<float>(at.z)};
          point.geometric_normal = point.normal = normal;
          most = std::max(most, irradiance(tracer, point));
          texels += static_cast<double>(table.texels()) / 2;
        }
      }
    }
  }
  at_least("texels looked at", texels, 4e4);
  at_most("share of an even sky that gets in", most, 2e-5);
  // And the vertices of the room themselves, each on its own border.
  const Scene room = gridded_room(8);
  const Visibility visibility(room);
  const DirectionTable table(16, 4);
  const PointTracer tracer(visibility, table, true);
  const VertexSampler sampler(room, visibility);
  double vertex_most = 0;
  for (std::uint32_t v = 0; v < room.position.size(); ++v) {
    vertex_most = std::max(vertex_most, irradiance(tracer, sampler.point(v)));
  }
  at_most("the same at vertices", vertex_most, 2e-5);
}

TEST(HardCases, Row35_FlippedAndZeroNormals) {
  property(
      "an open-sky vertex of zero, missing or flipped normals gets pi, not black; all counted");
  // One sample a texel in 16 x 16 faces and four where the horizon crosses: the sum of cosines is
  // within 1 % of pi (docs/method.md); a black row would be off by all of it.
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {}, 1, 3);
  const std::size_t vertices = scene.position.size();
  std::mt19937_64 random(6);
  for (std::size_t v = 0; v < vertices; v += 3) {
    scene.normal[v] = v % 2 ? Vec3{} : Vec3{kNan, 0, 1};
  }
  double flipped = 0;
  for (std::size_t t = 0; t < scene.triangle.size(); t += 5) {  // wound the other way
    std::swap(scene.triangle[t].vertex[1], scene.triangle[t].vertex[2]);
    ++flipped;
  }
  clean_scene(scene);
  at_least("normals made", static_cast<double>(scene.report.normals_made),
           static_cast<double>(vertices) / 3);
  at_least("triangles against their normals, counted",
           static_cast<double>(scene.report.against_normals), 1);
  const Visibility visibility(scene);
  const DirectionTable table(16, 4);
  const PointTracer tracer(visibility, table, true);
  const VertexSampler sampler(scene, visibility);
  double worst = 0;
  for (std::uint32_t v = 0; v < scene.position.size(); ++v) {
    // A made normal may face in or out; what it sees must be the open sky or, from inside the ball,
    // nothing at all: neighbours decide, and the ball's are outside.
    worst = std::max(worst, std::abs(irradiance(tracer, sampler.point(v)) - 1));
  }
  at_most("vertices: |irradiance / pi - 1|", worst, 0.01);

  // All normals against the faces: the normals decide, and the open sky is seen all the same.
  Scene quad = shapes::empty_scene();
  shapes::add_quad(quad, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  for (Vec3& n : quad.normal) n = -n;
  clean_scene(quad);
  at_least("flipped normals counted", static_cast<double>(quad.report.against_normals), 2);
  const Visibility flat(quad);
  const PointTracer flat_tracer(flat, table, true);
  const VertexSampler flat_sampler(quad, flat);
  double flat_worst = 0;
  for (std::uint32_t v = 0; v < quad.position.size(); ++v) {
    flat_worst = std::max(flat_worst, std::abs(irradiance(flat_tracer, flat_sampler.point(v)) - 1));
  }
  // And as a picture, from either side.
  for (const double side : {1.0, -1.0}) {
    for (int i = 0; i < 50; ++i) {
      std::uniform_real_distribution<double> place(-0.4, 0.4);
      const Vec3 from{place(random), side, place(random)};
      const auto hit =
          surface_hit(quad, flat, from, normalize(Vec3{place(random), -side, place(random)}));
      if (!hit) continue;
      Receiver receiver;
      receiver.position = hit->position;
      receiver.bsdf = bsdf_at(quad, *hit);
      flat_worst =
          std::max(flat_worst, std::abs(irradiance(flat_tracer, shading_point(receiver)) - 1));
    }
  }
  at_most("flipped quad: |irradiance / pi - 1|", flat_worst, 0.01);
}

}  // namespace
}  // namespace haarlight
