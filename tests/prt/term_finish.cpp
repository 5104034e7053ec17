// Meshes whose look changes with the view: factors, their file, what is shown.

#include "prt/term_finish.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "core/error.h"
#include "core/frame.h"
#include "core/parallel.h"
#include "prt/frame_relighter.h"
#include "prt/lighting_tracker.h"
#include "prt/mesh_picture.h"
#include "prt/mesh_relighter.h"
#include "prt/picture_relighter.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using fixtures::product;
using fixtures::SmallTransport;
using fixtures::TemporaryFolder;

SmallTransport transport_with_factors(int vertices, int terms, std::uint64_t seed) {
  SmallTransport small =
      fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(vertices, seed), seed, terms);
  small.info.view = std::make_shared<const ViewFactors>(
      fixtures::random_view_factors(small.info.mesh->position.size(), terms, seed));
  return small;
}

Vec3 normal_of(const TransportMesh& mesh, std::size_t v) {
  const auto& n = mesh.normal[v];
  return normalize(
      Vec3{static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])});
}

// B of a vertex in double, and the bound of its terms' sizes: sum |U|.
struct Expected {
  RgbD radiance;
  double size = 0;
};
Expected expected_radiance(const TransportInfo& info, std::span<const RgbD> sums, std::size_t v,
                           const Vec3& eye) {
  const Frame frame(normal_of(*info.mesh, v));
  Vec3 local = frame.to_local(normalize(eye - info.mesh->world(v)));
  if (local.z < 0) local = normalize(Vec3{local.x, local.y, 0});
  Expected out;
  const auto terms = static_cast<std::size_t>(info.terms);
  for (std::size_t k = 0; k < terms; ++k) {
    const RgbD u = sums[v * terms + k];
    out.radiance += view_factor(*info.view, info.view->set_of[v], k, local) * u;
    out.size += l1_norm(u);
  }
  return out;
}

TEST(TermFinish, RadianceEqualsTransportTimesShownTimesFactorsForEveryMethod) {
  for (const int terms : {1, 2, 4}) {
    const SmallTransport small = transport_with_factors(600, terms, 11);
    const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
    const std::vector<double> dense = fixtures::dense(small);
    const HaarLayout& layout = transport.layout();
    const Vec3 middle = bounding_sphere(*small.info.mesh).center;
    for (const auto method : {LightingMethod::nwa, LightingMethod::bi, LightingMethod::pbi}) {
      std::mt19937_64 random(2);
      LightingOptions options;
      options.method = method;
      options.wavelets = 25;
      LightingTracker tracker(layout, options);
      MeshRelighter relighter(transport);
      TermFinish finish(small.info.mesh, small.info.view);
      std::vector<Rgb> radiance(small.info.mesh->position.size());
      for (int frame = 0; frame < 6; ++frame) {
        const auto target = fixtures::random_lighting(layout, random);
        relighter.apply(frame == 0 ? tracker.start_exact(target) : tracker.advance(target));
        const Vec3 eye = middle + Vec3{std::sin(1.1 * frame), 0.4, std::cos(1.1 * frame)} * 3.0;
        finish.look(eye);
        finish.shade(relighter.radiance(), radiance);
        const std::vector<RgbD> sums = product(dense, tracker.shown());
        // u = 2^-24. The place on a profile is off by at most 8 u of its length 1, values by twice
        // that times 8 samples; the angle by 8 u / sin theta, cos(5 phi) by 5 times that and a few
        // roundings, values being at most 8 sin theta near the normal: 500 u in all. Sums add
        // bound A of docs/method.md, below 1e-9.
        for (std::size_t v = 0; v < radiance.size(); ++v) {
          const Expected wanted = expected_radiance(small.info, sums, v, eye);
          const RgbD off = RgbD(radiance[v]) - wanted.radiance;
          ASSERT_LE(l1_norm(off), 500 * 0x1p-24 * wanted.size + 1e-8)
              << "vertex " << v << ", frame " << frame << ", " << terms << " terms";
        }
      }
    }
  }
}

TEST(TermFinish, AConstantTermLooksAlikeFromEverywhere) {
  const SmallTransport small = transport_with_factors(300, 3, 12);
  const std::size_t vertices = small.info.mesh->position.size();
  std::vector<Rgb> sums(3 * vertices), radiance(vertices);
  for (std::size_t v = 0; v < vertices; ++v) sums[3 * v] = {1.25f, 0.5f, 3.0f};
  TermFinish finish(small.info.mesh, small.info.view);
  for (const Vec3& eye : {Vec3{0, 9, 0}, Vec3{-50, 1, 2}, small.info.mesh->world(7)}) {
    finish.look(eye);
    finish.shade(sums, radiance);
    for (std::size_t v = 2; v < vertices; v += 3) {  // the set with one constant term
      ASSERT_EQ(radiance[v], (Rgb{1.25f, 0.5f, 3.0f})) << v;
    }
  }
}

// Any finite mesh and eye have finite directions, found at the size of 1.
TEST(TermFinish, HugeAndTinyNumbersStayFinite) {
  const SmallTransport small = transport_with_factors(300, 3, 12);
  const std::size_t vertices = small.info.mesh->position.size();
  const std::vector<Rgb> sums(3 * vertices, Rgb{1, 1, 1});
  std::vector<Rgb> radiance(vertices);
  for (const float size : {1e-35f, 1e25f, 3e38f}) {
    TransportMesh mesh = *small.info.mesh;
    for (std::size_t v = 0; v < vertices; ++v) {
      for (float& x : mesh.position[v]) x = v % 3 == 0 ? (x < 0 ? -size : size) : x;
      for (float& n : mesh.normal[v]) n *= v % 2 == 0 ? size : 1 / size;
    }
    TermFinish finish(std::make_shared<const TransportMesh>(mesh), small.info.view);
    for (const Vec3& eye : {Vec3{0, 9, 0}, Vec3{-1e300, 1e20, 3e38}, mesh.world(3)}) {
      finish.look(eye);
      finish.shade(sums, radiance);
      for (std::size_t v = 0; v < vertices; ++v) ASSERT_TRUE(is_finite(radiance[v])) << v;
    }
  }
}

// Fills the stack below with NaN, for what reads it before it has written there.
[[gnu::noinline]] float stack_of_nans() {
  volatile float nans[16384];
  for (volatile float& x : nans) x = std::numeric_limits<float>::quiet_NaN();
  return nans[9999];
}

// A dark term between two that are not has an order, too, and it may be the highest: 0 times the
// cosine of it must be 0.
TEST(TermFinish, DarkTermsOfTheHighestOrderAreDark) {
  const int threads = thread_count();
  set_thread_count(1);  // this one's stack
  SmallTransport small = transport_with_factors(60, 3, 12);
  ViewFactors factors;
  factors.terms = 3, factors.resolution = 2;
  factors.order = {0, -40, 1};
  factors.profile = {{1, 1, 1}, {1, 1, 1}, {}, {}, {0, 0, 0}, {2, 2, 2}};
  const std::size_t vertices = small.info.mesh->position.size();
  factors.set_of.assign(vertices, 0);
  TermFinish finish(small.info.mesh, std::make_shared<const ViewFactors>(factors));
  const std::vector<Rgb> sums(3 * vertices, Rgb{1, 1, 1});
  std::vector<Rgb> radiance(vertices);
  ASSERT_TRUE(std::isnan(stack_of_nans()));
  finish.look({0, 9, 0});
  finish.shade(sums, radiance);
  for (std::size_t v = 0; v < vertices; ++v) {
    ASSERT_TRUE(is_finite(radiance[v])) << v;
    ASSERT_LE(std::abs(radiance[v].r - 1), 2.001f) << v;
    ASSERT_EQ(finish.factors()[3 * v + 1], Rgb{}) << v;
  }
  set_thread_count(threads);
}

TEST(TermFinish, SameBitsOnAnyNumberOfThreads) {
  const SmallTransport small = transport_with_factors(4000, 4, 13);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  std::mt19937_64 random(5);
  const auto light = fixtures::random_lighting(transport.layout(), random);
  const int before = thread_count();
  std::vector<Image> pictures;
  for (const int threads : {1, 7}) {
    set_thread_count(threads);
    pictures.push_back(relight_picture_once(transport, light, small.info.camera));
  }
  set_thread_count(before);
  ASSERT_EQ(pictures[0].pixels.size(), pictures[1].pixels.size());
  EXPECT_EQ(std::memcmp(pictures[0].pixels.data(), pictures[1].pixels.data(),
                        pictures[0].pixels.size() * sizeof(Rgb)),
            0);
}

// Overbeck 2006, Figure 11, right column: the exact solution is kept while the view moves.
TEST(TermFinish, AnOrbitTouchesNoTransportAndKeepsTheExactPicture) {
  const SmallTransport small = transport_with_factors(500, 4, 14);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const HaarLayout& layout = transport.layout();
  std::mt19937_64 random(6);
  const auto light = fixtures::random_lighting(layout, random);
  LightingOptions options;
  options.wavelets = 10;
  LightingTracker tracker(layout, options);
  PictureRelighter relighter(transport);
  // The light comes to rest by itself, ten wavelets a frame, and then the camera goes round.
  int frames = 0;
  relighter.apply(tracker.start_exact(fixtures::random_lighting(layout, random)));
  while (true) {
    const LightingUpdate& update = tracker.advance(light);
    if (update.empty()) break;
    relighter.apply(update);
    ASSERT_LT(++frames, 100);
  }
  ASSERT_GT(frames, 5);
  const Vec3 middle = bounding_sphere(*small.info.mesh).center;
  Image last = relighter.picture();
  for (int view = 0; view < 100; ++view) {
    const Camera camera = turned_about(small.info.camera, middle, 2 * kPi * view / 100);
    relighter.set_camera(camera);
    const RelightStats stats = relighter.apply(tracker.advance(light));
    ASSERT_EQ(stats.apply.columns, 0);
    ASSERT_EQ(stats.apply.transport_bytes, 0u);
    ASSERT_EQ(stats.apply.sum_bytes, 0u);
    // The same sums were reached by other updates: they differ by bound A, below 1e-9, a rounding
    // to float at most, which factors (at most 1, four of them) do not make larger.
    const Image exact = relight_picture_once(transport, light, camera);
    float largest = 0, difference = 0;
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
      largest = std::max(largest, l1_norm(exact.pixels[i]));
      difference = std::max(difference, l1_norm(exact.pixels[i] - relighter.picture().pixels[i]));
    }
    ASSERT_GT(largest, 0.1f);
    ASSERT_LE(difference, 1e-5f * largest) << "view " << view;
    if (view > 0) {
      ASSERT_NE(last.pixels, relighter.picture().pixels) << "view " << view;
    }
    last = relighter.picture();
  }
}

TEST(ViewFactors, FilesKeepThem) {
  const TemporaryFolder folder;
  const SmallTransport small = transport_with_factors(200, 3, 15);
  {
    TransportWriter writer(folder / "a.hlt", small.info, {small.thresholds, "test", false});
    writer.write_tile(0, small.tiles[0]);
  }
  {  // a journal of other factors is not continued
    ViewFactors changed = *small.info.view;
    changed.profile[4].g += 0.5f;
    TransportInfo other = small.info;
    other.view = std::make_shared<const ViewFactors>(changed);
    {
      TransportWriter same(folder / "a.hlt", small.info, {small.thresholds, "test", true});
      EXPECT_TRUE(same.has_tile(0));
    }
    TransportWriter writer(folder / "a.hlt", other, {small.thresholds, "test", true});
    EXPECT_FALSE(writer.has_tile(0));
  }
  TransportWriter writer(folder / "a.hlt", small.info, {small.thresholds, "test", false});
  for (int tile = 0; tile < writer.tile_count(); ++tile) {
    writer.write_tile(tile, small.tiles[static_cast<std::size_t>(tile)]);
  }
  writer.finish("{}");
  const Transport file = Transport::open(folder / "a.hlt");
  ASSERT_NE(file.info().view, nullptr);
  EXPECT_EQ(*file.info().view, *small.info.view);
}

TEST(ViewFactors, PacksAndRefuses) {
  const ViewFactors right = fixtures::random_view_factors(77, 3, 16);
  const std::vector<std::byte> packed = pack_view_factors(right);
  EXPECT_EQ(unpack_view_factors(packed, 3, 77, "a"), right);
  EXPECT_THROW(unpack_view_factors(packed, 2, 77, "a"), Error);
  EXPECT_THROW(unpack_view_factors(packed, 3, 78, "a"), Error);
  for (std::size_t size = 0; size < packed.size(); size += 5) {
    EXPECT_THROW(unpack_view_factors(std::span(packed).first(size), 3, 77, "a"), Error) << size;
  }
  const auto wrong = [&](auto change) {
    ViewFactors bad = right;
    change(bad);
    EXPECT_NE(check_view_factors(bad, 77), "");
    EXPECT_THROW(unpack_view_factors(pack_view_factors(bad), bad.terms, 77, "a"), Error);
  };
  EXPECT_EQ(check_view_factors(right, 77), "");
  wrong([](ViewFactors& f) { f.order[2] = kMostViewOrder + 1; });
  wrong([](ViewFactors& f) { f.order[2] = std::numeric_limits<int>::min(); });
  wrong([](ViewFactors& f) { f.profile[5].b = std::numeric_limits<float>::quiet_NaN(); });
  wrong([](ViewFactors& f) { f.set_of[76] = 3; });
  wrong([](ViewFactors& f) { f.set_of.pop_back(); });
  const TransportMesh mesh = fixtures::bumpy_sphere(90, 1);
  EXPECT_THROW(TermFinish(std::make_shared<const TransportMesh>(mesh),
                          std::make_shared<const ViewFactors>(right)),
               Error);
}

}  // namespace
}  // namespace haarlight
