// The reference path tracer against closed forms: what is compared with it must be able to trust
// it.

#include "tests/reference/path_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/parallel.h"
#include "tests/precompute/shapes.h"
#include "wavelet/cubemap.h"

namespace haarlight::reference {
namespace {

constexpr double kSigmas = 4;  // 6e-5 a channel by chance, and seeds are fixed

Sky even_sky(double radiance = 1) {
  return Sky([radiance](const Vec3&) { return RgbD{radiance, radiance, radiance}; });
}

Cubemap random_light(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<float> spread(1.0f);
  Cubemap map(n);
  for (Rgb& c : map.texels) c = {spread(random), spread(random), spread(random)};
  return map;
}

// Within 4 sigma, and `allowance` for what the scene's triangles are not exact in; sigma itself at
// most `largest_sigma`, lest noise proves anything right.
void expect_near(const Estimate& estimate, const RgbD& expected, double largest_sigma,
                 double allowance = 1e-9) {
  const auto channel = [&](double mean, double variance, double wanted, const char* name) {
    const double sigma = std::sqrt(variance);
    EXPECT_LE(sigma, largest_sigma) << name;
    EXPECT_NEAR(mean, wanted, kSigmas * sigma + allowance) << name << ", sigma " << sigma;
  };
  channel(estimate.mean.r, estimate.variance.r, expected.r, "red");
  channel(estimate.mean.g, estimate.variance.g, expected.g, "green");
  channel(estimate.mean.b, estimate.variance.b, expected.b, "blue");
}

Scene ground(double half = 10) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-half, 0, half}, {2 * half, 0, 0}, {0, 0, -2 * half});
  return scene;
}

Material glass(float ior) {
  Material m;
  m.model = SurfaceModel::glass;
  m.albedo = {1, 1, 1};
  m.ior = ior;
  return m;
}

double reflectance_straight_on(double ior) { return std::pow((ior - 1) / (ior + 1), 2); }

TEST(PathTracer, WhiteFurnace) {
  Scene scene = ground();
  shapes::add_box(scene, {-1, 0, -1}, {0, 1.5, 0.5});
  shapes::add_box(scene, {0.5, 0, -2}, {1.5, 0.7, 0.5}, 1);
  shapes::add_box(scene, {-1, 0, 1}, {-0.2, 0.6, 1.5}, 2);
  scene.material[0].albedo = {1, 1, 1};
  scene.material.push_back(glass(1.5f));
  scene.material.emplace_back();
  scene.material[2].model = SurfaceModel::mirror;
  scene.material[2].albedo = {1, 1, 1};
  Cubemap white(4);
  for (Rgb& c : white.texels) c = {1, 1, 1};
  const Camera camera = look_at({2, 3, 6}, {0, 0.5, 0}, 0.7, 12, 12);
  for (const bool aim : {false, true}) {
    PathOptions options;
    options.samples = 400;
    options.next_event = aim;
    options.background = true;
    const Sky sky = aim ? Sky(white) : even_sky();
    Estimate mean;
    const auto picture = PathTracer(scene, sky, options).picture(camera);
    for (const Estimate& e : picture) {
      mean.mean += e.mean * (1.0 / 144);
      mean.variance += e.variance * (1.0 / 144 / 144);
    }
    expect_near(mean, {1, 1, 1}, 0.003);
  }
}

TEST(PathTracer, LambertUnderOneTexel) {
  Scene scene = ground();
  scene.material[0].albedo = {0.8f, 0.4f, 0.2f};
  Cubemap map(8);
  const int x = 5, y = 1;  // of +Y: n.w is the y of its directions
  map.texels[cube_index(2, x, y, 8)] = {3, 3, 3};
  // Integral of y dw over the texel: y = (1 + u^2 + v^2)^(-1/2), dw = y^3 du dv.
  double sum = 0;
  constexpr int kFine = 400;
  for (int i = 0; i < kFine * kFine; ++i) {
    const double u = 2 * (x + (i % kFine + 0.5) / kFine) / 8 - 1;
    const double v = 2 * (y + (i / kFine + 0.5) / kFine) / 8 - 1;
    sum += std::pow(1 + u * u + v * v, -2.0);
  }
  const double irradiance = 3 * sum * std::pow(2.0 / 8 / kFine, 2);
  const RgbD expected = RgbD(scene.material[0].albedo) * (irradiance / kPi);
  const Sky sky(map);
  for (const bool aim : {true, false}) {
    PathOptions options;
    options.samples = aim ? 2000 : 200'000;
    options.next_event = aim;
    const Estimate e = PathTracer(scene, sky, options).radiance({0, 3, 0}, {0.6, -0.8, 0});
    expect_near(e, expected, (aim ? 0.005 : 0.05) * expected.r, 1e-5 * expected.r);
  }
}

TEST(PathTracer, PhongLobeSeenStraightOnKeepsItsReflectance) {
  Scene scene = ground();
  scene.material[0].albedo = {0.3f, 0.2f, 0.1f};
  scene.material[0].specular = {0.4f, 0.4f, 0.5f};
  for (const float exponent : {0.0f, 7.0f, 900.0f}) {
    scene.material[0].exponent = exponent;
    PathOptions options;
    options.samples = 20'000;
    const Sky sky = even_sky(2);
    const Estimate e = PathTracer(scene, sky, options).radiance({0, 3, 0}, {0, -1, 0});
    const RgbD diffuse = RgbD(scene.material[0].albedo) * 2.0;
    expect_near(e, diffuse + RgbD(scene.material[0].specular) * 2.0, 0.01);
    options.gloss = false;
    expect_near(PathTracer(scene, sky, options).radiance({0, 3, 0}, {0, -1, 0}), diffuse, 0.01);
  }
}

// White metal and white plastic lose nothing: the lobe is compensated, and what the coat lets pass
// comes back from below. Both to the 1 % that their tables promise.
TEST(PathTracer, MetallicRoughnessKeepsItsEnergy) {
  Scene scene = ground();
  Material& m = scene.material[0];
  m.model = SurfaceModel::metallic_roughness;
  m.albedo = {1, 1, 1};
  Cubemap white(4);
  for (Rgb& c : white.texels) c = {1, 1, 1};
  const Sky sky(white);
  for (const float metallic : {0.0f, 1.0f}) {
    for (const float roughness : {0.0f, 0.1f, 0.4f, 1.0f}) {
      m.metallic = metallic, m.roughness = roughness;
      for (const bool aim : {false, true}) {
        PathOptions options;
        options.samples = 20'000;
        options.next_event = aim;
        const Estimate e = PathTracer(scene, sky, options).radiance({0, 3, 0}, {0.6, -0.8, 0});
        SCOPED_TRACE(metallic + 10 * roughness);
        expect_near(e, {1, 1, 1}, 0.01, 0.01);
      }
    }
  }
}

// Inside a sphere every place sees every other with the same form factor. Where a cap of share f of
// its area is open to an even sky of 1, the wall is equally bright everywhere:
//   B = rho (f + (1 - f) B),  and after n bounces  B_n = rho f sum over k <= n of (rho (1 - f))^k.
TEST(PathTracer, OpenSphereInterreflectsAsItsSeries) {
  Scene scene = shapes::empty_scene();
  scene.material[0].albedo = {0.9f, 0.5f, 0.2f};
  constexpr int kAround = 96, kRows = 72;
  const double opening = 0.8;  // radians from the zenith to the rim
  const double open = (1 - std::cos(opening)) / 2;
  const auto at = [&](int i, int j) {
    const double down = opening + (kPi - opening) * j / kRows, around = 2 * kPi * i / kAround;
    const double ring = j == kRows ? 0.0 : std::sin(down);
    return Vec3{ring * std::cos(around), std::cos(down), ring * std::sin(around)};
  };
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const auto corner = [&](int a, int b) {
        const Vec3 p = at(a % kAround, b);
        return shapes::add_vertex(scene, p, normalize(-p));
      };
      const auto a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1),
                 d = corner(i, j + 1);
      scene.triangle.push_back({{a, b, c}, 0});
      if (j + 1 < kRows) scene.triangle.push_back({{a, c, d}, 0});
    }
  }
  const Sky sky = even_sky();
  for (const int bounces : {0, 1, 3, 10'000}) {
    PathOptions options;
    options.samples = 40'000;
    options.max_bounces = bounces;
    const auto series = [&](double rho) {
      double sum = 0, term = rho * open;
      for (int k = 0; k <= std::min(bounces, 1000); ++k, term *= rho * (1 - open)) sum += term;
      return sum;
    };
    const Rgb rho = scene.material[0].albedo;
    const RgbD expected{series(static_cast<double>(rho.r)), series(static_cast<double>(rho.g)),
                        series(static_cast<double>(rho.b))};
    for (const Vec3& target : {Vec3{0.2, -0.9, 0.1}, Vec3{0.9, 0.1, 0.1}}) {
      const Vec3 eye{-0.3, 1.2, 0};
      const Estimate e = PathTracer(scene, sky, options).radiance(eye, normalize(target - eye));
      // A facet is 2 pi / 96 wide and lies up to 1 - cos(pi / 96) = 5e-4 inside the sphere; form
      // factors are off by as much.
      expect_near(e, expected, 0.004, 1e-3);
    }
  }
}

TEST(PathTracer, MirrorShowsTheTexelItPointsAt) {
  Scene scene = ground();
  scene.material[0].model = SurfaceModel::mirror;
  scene.material[0].albedo = {0.8f, 0.6f, 0.4f};
  const Cubemap map = random_light(8, 3);
  const Sky sky(map);
  std::mt19937 random(9);
  for (int i = 0; i < 50; ++i) {
    Vec3 direction = shapes::random_direction(random);
    direction.y = -std::abs(direction.y) - 0.3;
    direction = normalize(direction);
    const Vec3 seen{direction.x, -direction.y, direction.z};
    const CubePoint at = cube_point(seen);
    const Rgb texel = map.texels[cube_index(at.face, cube_texel(at.u, 8), cube_texel(at.v, 8), 8)];
    PathOptions options;
    options.samples = 64;
    const Estimate e = PathTracer(scene, sky, options).radiance({0, 1, 0}, direction);
    // Weights add up to the reflectance on average; the last chance is one less nothing.
    expect_near(e, RgbD(texel) * RgbD(scene.material[0].albedo), 1e-12);
    options.specular = false;
    EXPECT_EQ(PathTracer(scene, sky, options).radiance({0, 1, 0}, direction).mean, RgbD{});
  }
}

// Back and forth between both faces, weakened by a on each way through:
//   T = (1 - R)^2 a / (1 - R^2 a^2),   reflected R + (1 - R)^2 R a^2 / (1 - R^2 a^2).
TEST(PathTracer, GlassSlab) {
  const double ior = 1.6, thickness = 0.5;
  const Sky sky([](const Vec3& w) { return w.y > 0 ? RgbD{1, 1, 0} : RgbD{0, 2, 3}; });
  for (const double sine : {0.0, 0.6, 0.95}) {
    Scene scene = shapes::empty_scene();
    scene.material[0] = glass(static_cast<float>(ior));
    scene.material[0].extinction = {0.7f, 0.7f, 0.7f};
    shapes::add_box(scene, {-400, 0, -400}, {400, thickness, 400});
    const double cosine = std::sqrt(1 - sine * sine);
    const double inner = std::sqrt(1 - sine * sine / (ior * ior));
    const double s = (cosine - ior * inner) / (cosine + ior * inner);
    const double p = (inner - ior * cosine) / (inner + ior * cosine);
    const double r = (s * s + p * p) / 2;
    const double a = std::exp(-0.7 * thickness / inner);
    const double through = (1 - r) * (1 - r) * a / (1 - r * r * a * a);
    const double back = r + (1 - r) * (1 - r) * r * a * a / (1 - r * r * a * a);
    PathOptions options;
    options.samples = 100'000;
    const auto looking = [&](const PathOptions& o) {
      return PathTracer(scene, sky, o).radiance({0, 3, 0}, {sine, -cosine, 0});
    };
    // The index is a float, 1e-7 off.
    expect_near(looking(options), {back, back + 2 * through, 3 * through}, 0.006, 1e-6);
    options.specular = false;
    EXPECT_EQ(looking(options).mean, RgbD{});
    // A pane is the same slab without a way inside: a = 1, at its own place.
    options.specular = true;
    scene.material[0].thin = true;
    scene.triangle.resize(0);
    shapes::add_quad(scene, {-99, 0, 99}, {198, 0, 0}, {0, 0, -198});
    const double pane = (1 - r) / (1 + r);
    expect_near(looking(options), {1 - pane, 1 - pane + 2 * pane, 3 * pane}, 0.006, 1e-6);
  }
}

// Straight down through the level face of a prism and out of the lower one, inclined by A: there
// the ray leaves at asin(n sin A) from that face's normal.
TEST(PathTracer, PrismBendsAsSnellSays) {
  const double ior = 1.5, apex = 0.5;
  Scene scene = shapes::empty_scene();
  scene.material[0] = glass(static_cast<float>(ior));
  const auto face = [&](const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    const Vec3 n = normalize(cross(b - a, c - a));
    const auto ia = shapes::add_vertex(scene, a, n), ib = shapes::add_vertex(scene, b, n),
               ic = shapes::add_vertex(scene, c, n), id = shapes::add_vertex(scene, d, n);
    scene.triangle.push_back({{ia, ib, ic}, 0});
    scene.triangle.push_back({{ia, ic, id}, 0});
  };
  const double depth = 4 * std::tan(apex);
  face({0, 0, 9}, {4, 0, 9}, {4, 0, -9}, {0, 0, -9});            // level, upwards
  face({0, 0, -9}, {4, -depth, -9}, {4, -depth, 9}, {0, 0, 9});  // inclined, downwards
  face({4, 0, -9}, {4, 0, 9}, {4, -depth, 9}, {4, -depth, -9});  // the thick end
  const double leaves = std::asin(ior * std::sin(apex));
  // The inclined face's normal is apex from straight down towards -x; the ray bends away from it,
  // towards the thick end.
  const Vec3 expected{std::sin(leaves - apex), -std::cos(leaves - apex), 0};
  const Sky narrow([&](const Vec3& w) {
    return dot(w, expected) > 1 - 1e-9 ? RgbD{1, 1, 1} : RgbD{};
  });
  const double r1 = reflectance_straight_on(ior);
  const double s = std::pow(std::sin(apex - leaves) / std::sin(apex + leaves), 2);
  const double p = std::pow(std::tan(apex - leaves) / std::tan(apex + leaves), 2);
  const double through = (1 - r1) * (1 - (s + p) / 2);
  PathOptions options;
  options.samples = 20'000;
  expect_near(PathTracer(scene, narrow, options).radiance({2, 1, 0.01}, {0, -1, 0}),
              {through, through, through}, 0.004, 1e-6);
}

// A ground beside a tall mirror under an even sky: the half of the sky that the mirror hides is
// there again in it. Whether it comes is what the options say.
TEST(PathTracer, OptionsSwitchEffectsOff) {
  Scene scene = ground(2e4);
  scene.material[0].albedo = {0.5f, 0.5f, 0.5f};
  scene.material.emplace_back();
  scene.material[1].model = SurfaceModel::mirror;
  scene.material[1].albedo = {0.7f, 0.7f, 0.7f};
  shapes::add_quad(scene, {0, 0, -1e4}, {0, 1e4, 0}, {0, 0, 2e4}, 1);
  const Sky sky = even_sky();
  const auto seen = [&](auto&& change) {
    PathOptions options;
    options.samples = 20'000;
    change(options);
    return PathTracer(scene, sky, options).radiance({1, 1, 0}, {0, -1, 0});
  };
  const auto expect = [&](const Estimate& e, double value) {
    expect_near(e, {value, value, value}, 0.003, 1e-4);  // the mirror ends 1e4 m away
  };
  expect(seen([](PathOptions&) {}), 0.5 * (0.5 + 0.5 * static_cast<double>(0.7f)));
  expect(seen([](PathOptions& o) { o.max_bounces = 0; }),
         0.5 * (0.5 + 0.5 * static_cast<double>(0.7f)));
  expect(seen([](PathOptions& o) { o.caustics = false; }), 0.25);
  expect(seen([](PathOptions& o) { o.specular = false; }),
         0.5 * (0.5 + 0.5 * static_cast<double>(0.7f)));
  expect(seen([](PathOptions& o) { o.shadows = false; }), 0.5);
  // The mirror itself is seen, caustics or not: it shows the ground, half dark without them.
  PathOptions options;
  options.samples = 20'000;
  options.caustics = false;
  expect(PathTracer(scene, sky, options).radiance({1, 1, 0}, normalize({-1, -0.5, 0})),
         static_cast<double>(0.7f) * 0.25);
  options.specular = false;
  EXPECT_EQ(PathTracer(scene, sky, options).radiance({1, 1, 0}, normalize({-1, -0.5, 0})).mean,
            RgbD{});
}

TEST(PathTracer, HolesLetLightPass) {
  Scene scene = ground();
  scene.material.emplace_back();
  scene.material[1].albedo = {0, 0, 0};
  scene.material[1].texture = 0;
  scene.material[1].alpha_cutoff = 0.5f;
  shapes::add_quad(scene, {-2, 1, 2}, {4, 0, 0}, {0, 0, -4}, 1);
  for (std::uint32_t v = 4; v < 8; ++v) {  // u = (x + 2) / 4
    scene.uv[v] = {static_cast<float>((scene.position[v].x + 2) / 4), 0.5f};
  }
  // Four columns: the middle two, -1 < x < 1, are a hole.
  scene.texture.emplace_back(4, 1);
  scene.alpha.push_back({1, 0, 0, 1});
  const Sky sky = even_sky();
  PathOptions options;
  options.max_bounces = 0;
  options.samples = 2000;
  const PathTracer tracer(scene, sky, options);
  EXPECT_GT(tracer.radiance({0, 3, 0}, {0, -1, 0}).mean.r, 0.1);
  EXPECT_EQ(tracer.radiance({1.5, 3, 0}, {0, -1, 0}).mean, RgbD{});
  // From the ground below the hole's middle, the cover hides what a 4 x 4 square at height 1 hides
  // less a 2 x 4 one: differential area to parallel rectangle, four times that of a corner's.
  const auto factor = [](double a, double b) {  // corner above the point, sides a and b, height 1
    const double x = std::sqrt(1 + a * a), y = std::sqrt(1 + b * b);
    return (a / x * std::atan(b / x) + b / y * std::atan(a / y)) / (2 * kPi);
  };
  const double hidden = 4 * (factor(2, 2) - factor(1, 2));
  const double expected = 0.5 * (1 - hidden);
  expect_near(tracer.radiance({0, 3, 0}, {0, -1, 0}), {expected, expected, expected}, 0.01);
}

TEST(PathTracer, AimingChangesNothingButTheNoise) {
  Scene scene = ground();
  scene.material[0].albedo = {0.6f, 0.5f, 0.4f};
  scene.material.emplace_back();
  scene.material[1].albedo = {0.5f, 0.1f, 0.1f};
  scene.material[1].specular = {0.3f, 0.3f, 0.3f};
  scene.material[1].exponent = 40;
  scene.material.push_back(glass(1.4f));
  shapes::add_box(scene, {-1.5, 0, -1}, {-0.5, 1.5, 0.5}, 1);
  shapes::add_sphere(scene, {0.4, 0.6, 0.3}, 0.6, 3, 2);
  Cubemap map = random_light(4, 8);
  map.texels[cube_index(2, 1, 2, 4)] *= 30.0f;
  const Sky sky(map);
  const Camera camera = look_at({1, 3, 5}, {0, 0.4, 0}, 0.6, 8, 8);
  PathOptions options;
  options.samples = 1500;
  const auto aimed = PathTracer(scene, sky, options).picture(camera);
  options.next_event = false;
  options.seed = 2;
  options.samples = 6000;
  const auto plain = PathTracer(scene, sky, options).picture(camera);
  double sum = 0, variance = 0, less_noise = 0;
  for (std::size_t i = 0; i < aimed.size(); ++i) {
    const double off = aimed[i].mean.g - plain[i].mean.g;
    const double spread = aimed[i].variance.g + plain[i].variance.g;
    EXPECT_LE(std::abs(off), 5 * std::sqrt(spread) + 1e-12) << i;
    sum += off;
    variance += spread;
    less_noise += 1500 * aimed[i].variance.g < 6000 * plain[i].variance.g ? 1.0 : 0.0;
  }
  EXPECT_LE(std::abs(sum), kSigmas * std::sqrt(variance));
  EXPECT_GT(less_noise, 32);
}

TEST(PathTracer, SameBitsOnAnyNumberOfThreads) {
  Scene scene = ground();
  shapes::add_box(scene, {-1, 0, -1}, {0, 1.5, 0.5});
  const Sky sky(random_light(4, 2));
  const Camera camera = look_at({2, 3, 6}, {0, 0.5, 0}, 0.7, 6, 6);
  PathOptions options;
  options.samples = 8;
  const int before = thread_count();
  set_thread_count(1);
  const auto one = PathTracer(scene, sky, options).picture(camera);
  set_thread_count(3);
  const auto three = PathTracer(scene, sky, options).picture(camera);
  set_thread_count(before);
  options.seed = 2;
  const auto other = PathTracer(scene, sky, options).picture(camera);
  int different = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].mean, three[i].mean);
    different += one[i].mean == other[i].mean ? 0 : 1;
  }
  EXPECT_GT(different, 18);
}

}  // namespace
}  // namespace haarlight::reference
