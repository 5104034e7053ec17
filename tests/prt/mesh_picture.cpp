// The rasteriser against rays, and the identities that a picture of a mesh must keep.

#include "prt/mesh_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

std::shared_ptr<const TransportMesh> shared(TransportMesh mesh) {
  return std::make_shared<const TransportMesh>(std::move(mesh));
}

void add_triangle(TransportMesh& mesh, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (const Vec3& p : {a, b, c}) {
    mesh.position.push_back(
        {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    mesh.normal.push_back({0, 1, 0});
  }
  mesh.triangle.push_back({first, first + 1, first + 2});
}

TransportMesh soup(int triangles, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto point = [&] { return Vec3{uniform(random), uniform(random), uniform(random)}; };
  TransportMesh mesh;
  mesh.origin = {100, -20, 7};
  for (int i = 0; i < triangles; ++i) {
    const Vec3 at = point();
    add_triangle(mesh, at + 0.3 * point(), at + 0.3 * point(), at + 0.3 * point());
  }
  return mesh;
}

// A flat grid of cells x cells quads over [-size, size]^2 in the plane z = 0, cut along alternating
// diagonals; inner vertices are shared and shaken by `shake` of a cell.
TransportMesh grid(int cells, double size, double shake, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-shake, shake);
  TransportMesh mesh;
  const auto side = static_cast<std::uint32_t>(cells + 1);
  for (std::uint32_t j = 0; j < side; ++j) {
    for (std::uint32_t i = 0; i < side; ++i) {
      const bool inner = i > 0 && j > 0 && i + 1 < side && j + 1 < side;
      const double x = i + (inner ? uniform(random) : 0), y = j + (inner ? uniform(random) : 0);
      mesh.position.push_back({static_cast<float>((2 * x / cells - 1) * size),
                               static_cast<float>((2 * y / cells - 1) * size), 0});
      mesh.normal.push_back({0, 0, 1});
    }
  }
  for (std::uint32_t j = 0; j + 1 < side; ++j) {
    for (std::uint32_t i = 0; i + 1 < side; ++i) {
      const std::uint32_t a = j * side + i, b = a + 1, c = a + side, d = c + 1;
      if ((i + j) % 2) {
        mesh.triangle.insert(mesh.triangle.end(), {{a, b, d}, {c, a, d}});
      } else {
        mesh.triangle.insert(mesh.triangle.end(), {{a, b, c}, {c, b, d}});
      }
    }
  }
  return mesh;
}

// The grid that vertices in front are rounded to, pixels; see MeshPicture.
double step_of(const Camera& camera) {
  double size = 8;
  while (size < std::max(camera.width, camera.height)) size *= 2;
  return size * 0x1p-23;
}

struct RayHit {
  double t = -1, b0 = 0, b1 = 0, b2 = 0;
  bool inside() const { return t > 0 && b0 >= 0 && b1 >= 0 && b2 >= 0; }
};

// Moeller and Trumbore 1997, without its early exits.
RayHit cast(const TransportMesh& mesh, std::size_t triangle, const Vec3& origin, const Vec3& d) {
  const auto& v = mesh.triangle[triangle];
  const Vec3 a = mesh.world(v[0]), e1 = mesh.world(v[1]) - a, e2 = mesh.world(v[2]) - a;
  const Vec3 p = cross(d, e2), from = origin - a, q = cross(from, e1);
  const double inverse = 1 / dot(e1, p);
  RayHit hit;
  hit.b1 = dot(from, p) * inverse;
  hit.b2 = dot(d, q) * inverse;
  hit.b0 = 1 - hit.b1 - hit.b2;
  hit.t = dot(e2, q) * inverse;
  return hit;
}

TEST(MeshPicture, SeesWhatRaysSee) {
  std::mt19937_64 random(1);
  struct Case {
    TransportMesh mesh;
    Camera camera;
  };
  std::vector<Case> cases;
  const Vec3 middle{100, -20, 7};
  cases.push_back({soup(60, random), look_at(middle + Vec3{1, 2, 4}, middle, 0.7, 61, 47)});
  // From inside, so that triangles lie all around and some reach behind the camera.
  cases.push_back({soup(200, random), look_at(middle, middle + Vec3{1, 0.2, 0.1}, 2.2, 64, 64)});
  TransportMesh ground = soup(20, random);
  add_triangle(ground, {-50, -1, -50}, {70, -1, -40}, {-10, -1, 90});
  cases.push_back(
      {ground, look_at(middle + Vec3{0, 0.1, 0.3}, middle + Vec3{3, -1, 0}, 1.2, 50, 40)});
  cases.push_back({fixtures::bumpy_sphere(800, 2), look_at({5, 4, -2}, {3, 2, -5}, 0.9, 64, 48)});

  for (const auto& [mesh, camera] : cases) {
    MeshPicture picture(shared(mesh), 1);
    picture.look(camera);
    const double step = step_of(camera);
    int compared = 0, seen = 0, unsure = 0;
    for (int y = 0; y < camera.height; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        // A vertex moves by half a step each way, so what is the same at a step's distance is sure.
        double nearest = std::numeric_limits<double>::infinity();
        double unsure_from = nearest;
        std::size_t triangle = mesh.triangle.size();
        RayHit best;
        double moved = 0;  // how far barycentric coordinates go within a step
        for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
          const RayHit hit = cast(mesh, t, camera.position, camera.direction(x + 0.5, y + 0.5));
          double farthest = 0;
          bool same = true;
          for (const double sx : {-step, step}) {
            for (const double sy : {-step, step}) {
              const RayHit near =
                  cast(mesh, t, camera.position, camera.direction(x + 0.5 + sx, y + 0.5 + sy));
              same = same && near.inside() == hit.inside();
              farthest =
                  std::max({farthest, std::abs(near.b1 - hit.b1), std::abs(near.b2 - hit.b2)});
            }
          }
          if (!same) unsure_from = std::min(unsure_from, std::abs(hit.t));
          if (hit.inside() && hit.t < nearest) {
            nearest = hit.t, triangle = t, best = hit, moved = farthest;
          }
        }
        if (unsure_from <= nearest && std::isfinite(unsure_from)) {
          ++unsure;
          continue;
        }
        const auto fragments = picture.fragments(x, y);
        ++compared;
        if (triangle == mesh.triangle.size()) {
          ASSERT_TRUE(fragments.empty()) << x << ' ' << y;
          continue;
        }
        ++seen;
        ASSERT_EQ(fragments.size(), 1u) << x << ' ' << y;
        ASSERT_EQ(fragments[0].triangle, triangle) << x << ' ' << y;
        EXPECT_EQ(fragments[0].share, 1.0f);
        // Twice the way of a step, for both other corners move too, and rounding to float.
        EXPECT_NEAR(static_cast<double>(fragments[0].second), best.b1, 4 * moved + 1e-6);
        EXPECT_NEAR(static_cast<double>(fragments[0].third), best.b2, 4 * moved + 1e-6);
      }
    }
    EXPECT_GT(seen, compared / 20);
    EXPECT_LT(unsure, camera.width * camera.height / 100);
  }
}

// Pixels of 1 x 1 in the plane z = 0, the middle of the picture at the origin.
Camera square_on(int size) {
  Camera camera;
  camera.width = camera.height = size;
  camera.vertical_fov = kPi / 2;
  camera.position = {0, 0, 0.5 * size};
  return camera;
}

// Every triangle by itself covers what it owns; together they must own each place of the picture
// exactly once. Shares are quarters, so the sums are exact. Vertices on the very places that are
// looked at are the hard case: cells of 1 and of 1/8 pixel put them there.
TEST(MeshPicture, NeighboursShareEveryPlaceExactlyOnce) {
  std::mt19937_64 random(2);
  struct Case {
    int size, cells;
    double half, shake;
  };
  for (const Case& c : {Case{8, 9, 4.5, 0}, {2, 24, 1.5, 0}, {16, 12, 9, 0.4}, {9, 10, 5, 0}}) {
    const TransportMesh mesh = grid(c.cells, c.half, c.shake, random);
    for (const int samples : {1, 4}) {
      for (const double tilt : {0.0, 0.3}) {
        Camera camera = square_on(c.size);
        camera = turned_about(camera, {0, 0, 0}, tilt);
        std::vector<float> sum(static_cast<std::size_t>(c.size * c.size), 0.0f);
        for (const auto& triangle : mesh.triangle) {
          TransportMesh one = mesh;
          one.triangle = {triangle};
          MeshPicture picture(shared(one), samples);
          picture.look(camera);
          for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += picture.coverage()[p];
        }
        MeshPicture all(shared(mesh), samples);
        all.look(camera);
        for (std::size_t p = 0; p < sum.size(); ++p) {
          ASSERT_EQ(sum[p], all.coverage()[p]) << "pixel " << p << " of " << c.size;
          if (tilt == 0) {
            ASSERT_EQ(sum[p], 1.0f) << "pixel " << p << " of " << c.size;
          }
        }
      }
    }
  }
}

// The same where edges reach behind the camera, from a place just above the ground. The far border
// may take a place of the horizon or not, but no place may be taken twice or left out below it.
TEST(MeshPicture, NeighboursShareEveryPlaceBehindTheCameraToo) {
  std::mt19937_64 random(3);
  TransportMesh mesh = grid(8, 400, 0.3, random);
  Camera camera = look_at({3, -2, 1.5}, {40, 11, 0.5}, 1.0, 31, 24);
  camera.orientation = {{Vec3{0.3, 0, -1}, Vec3{-1, 0, -0.3}, Vec3{0, 1, 0}}};
  for (Vec3& row : camera.orientation.row) row = normalize(row);
  std::vector<float> sum(31 * 24, 0.0f);
  int behind = 0;
  for (const auto& triangle : mesh.triangle) {
    TransportMesh one = mesh;
    one.triangle = {triangle};
    int back = 0;
    for (const auto v : triangle) {
      back += dot(mesh.world(v) - camera.position, camera.orientation * Vec3{0, 0, -1}) < 0;
    }
    behind += back == 1 || back == 2;
    MeshPicture picture(shared(one), 4);
    picture.look(camera);
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] += picture.coverage()[p];
  }
  EXPECT_GT(behind, 2);
  for (std::size_t y = 0; y < 24; ++y) {
    for (std::size_t x = 0; x < 31; ++x) {
      const Vec3 d = camera.direction(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
      if (d.z < -0.03) {
        ASSERT_EQ(sum[y * 31 + x], 1.0f) << x << ' ' << y;
      }
      if (d.z > 0.03) {
        ASSERT_EQ(sum[y * 31 + x], 0.0f) << x << ' ' << y;
      }
    }
  }
}

TEST(MeshPicture, ConstantsComeOutExactly) {
  const auto mesh = shared(fixtures::bumpy_sphere(600, 4));
  MeshPicture picture(mesh, 4);
  picture.look(look_at({3, 4, -1}, {3, 2, -5}, 0.8, 70, 53));
  const Rgb light{0.37f, 1e6f, 3e-7f};
  Image image;
  picture.shade(std::vector<Rgb>(mesh->position.size(), light), image);
  int partly = 0, covered = 0;
  for (std::size_t p = 0; p < image.pixels.size(); ++p) {
    const float share = picture.coverage()[p];
    EXPECT_EQ(image.pixels[p], share * light);  // shares are quarters: exact
    partly += share > 0 && share < 1;
    covered += share == 1;
  }
  EXPECT_GT(partly, 50);
  EXPECT_GT(covered, 500);
}

// A function that is linear in space, told at the vertices of a plane, is met again where a ray
// meets the plane, to a step's way (see SeesWhatRaysSee) and rounding to float.
TEST(MeshPicture, LinearFunctionsComeOutToRounding) {
  std::mt19937_64 random(5);
  const auto mesh = shared(grid(7, 30, 0.4, random));
  const auto value = [](const Vec3& p) { return 2 + 0.05 * p.x - 0.03 * p.y; };
  std::vector<Rgb> radiance;
  for (std::size_t v = 0; v < mesh->position.size(); ++v) {
    const auto f = static_cast<float>(value(mesh->world(v)));
    radiance.push_back({f, 2 * f, -f});
  }
  for (const Vec3& eye : {Vec3{0, 0, 20}, Vec3{25, 10, 6}, Vec3{4, -27, 1}}) {
    const Camera camera = look_at(eye, {0, 2, 0}, 0.9, 64, 64);
    MeshPicture picture(mesh, 1);
    picture.look(camera);
    Image image;
    picture.shade(radiance, image);
    const double step = step_of(camera);
    int compared = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        if (picture.coverage()[image.index(x, y)] == 0) continue;
        const auto meets = [&](double px, double py) {
          const Vec3 d = camera.direction(px, py);
          return value(eye + d * (-eye.z / d.z));
        };
        const double expected = meets(x + 0.5, y + 0.5);
        const double way = std::abs(meets(x + 0.5 + step, y + 0.5) - expected) +
                           std::abs(meets(x + 0.5, y + 0.5 + step) - expected);
        const double tolerance = 4 * way + 8 * 0x1p-24 * 5;  // values below 5, a few operations
        EXPECT_NEAR(static_cast<double>(image.at(x, y).r), expected, tolerance);
        EXPECT_NEAR(static_cast<double>(image.at(x, y).g), 2 * expected, 2 * tolerance);
        EXPECT_NEAR(static_cast<double>(image.at(x, y).b), -expected, tolerance);
        ++compared;
      }
    }
    EXPECT_GT(compared, 1500);
  }
}

TEST(MeshPicture, SidesDoNotMatterAndOrderDecidesTies) {
  std::mt19937_64 random(6);
  TransportMesh mesh = soup(80, random);
  const Camera camera = look_at(mesh.origin + Vec3{2, 1, 3}, mesh.origin, 0.8, 40, 40);
  MeshPicture front(shared(mesh), 4);
  front.look(camera);
  TransportMesh flipped = mesh;
  for (auto& t : flipped.triangle) std::swap(t[1], t[2]);
  MeshPicture back(shared(flipped), 4);
  back.look(camera);
  EXPECT_TRUE(std::ranges::equal(front.coverage(), back.coverage()));

  TransportMesh twice = mesh;
  twice.triangle.insert(twice.triangle.end(), mesh.triangle.begin(), mesh.triangle.end());
  MeshPicture both(shared(twice), 4);
  both.look(camera);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (const auto& f : both.fragments(x, y)) EXPECT_LT(f.triangle, mesh.triangle.size());
    }
  }
}

TEST(MeshPicture, TheSameBitsOnAnyNumberOfThreadsAndWhenUsedAgain) {
  const auto mesh = shared(fixtures::bumpy_sphere(6000, 7));
  std::mt19937_64 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Rgb> radiance(mesh->position.size());
  for (Rgb& r : radiance) r = {uniform(random), uniform(random), uniform(random)};
  const Camera camera = look_at({5, 4, -1}, {3, 2, -5}, 0.8, 123, 77);
  const int before = thread_count();
  Image images[3];
  std::vector<float> coverages[3];
  for (std::size_t run = 0; run < 3; ++run) {
    set_thread_count(run == 0 ? 1 : 7);
    MeshPicture picture(mesh);
    if (run == 2) picture.look(look_at({5, 3, -9}, {3, 2, -5}, 1.1, 200, 150));
    picture.look(camera);
    picture.shade(radiance, images[run]);
    coverages[run].assign(picture.coverage().begin(), picture.coverage().end());
  }
  set_thread_count(before);
  for (std::size_t run : {1u, 2u}) {
    EXPECT_EQ(images[run].pixels, images[0].pixels);
    EXPECT_EQ(coverages[run], coverages[0]);
  }
}

TEST(MeshPicture, RefusesWhatItCannotDraw) {
  const auto mesh = shared(fixtures::bumpy_sphere(40, 8));
  EXPECT_THROW(MeshPicture(nullptr), Error);
  EXPECT_THROW(MeshPicture(mesh, 3), Error);
  MeshPicture picture(mesh);
  Camera camera;
  camera.position.x = std::nan("");
  EXPECT_THROW(picture.look(camera), Error);
  camera = {};
  camera.width = 0;
  EXPECT_THROW(picture.look(camera), Error);
  camera = {};
  camera.vertical_fov = 4;
  EXPECT_THROW(picture.look(camera), Error);
  picture.look({});
  Image image;
  EXPECT_THROW(picture.shade(std::vector<Rgb>(3), image), Error);
}

}  // namespace
}  // namespace haarlight
