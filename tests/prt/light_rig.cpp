// Light by value: the same bits as a plain motion, linear in its parts, and what it refuses.

#include "prt/light_rig.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "prt/motion.h"

namespace haarlight {
namespace {

Environment sky(float seed) {
  Image image(64, 32);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      image.at(x, y) = {seed + static_cast<float>(x), 1 + static_cast<float>(y) * seed,
                        static_cast<float>((x * 7 + y * 13) % 11)};
    }
  }
  return Environment(image);
}

LightRig rig_of_two(const HaarLayout& layout) {
  LightRig rig(layout);
  rig.set_environment(0, sky(0.5f));
  rig.set_environment(1, sky(2));
  return rig;
}

TEST(LightRig, GivesTheBitsOfAPlainMotion) {
  const HaarLayout layout(16);
  LightRig rig = rig_of_two(layout);
  const Environment a = sky(0.5f), b = sky(2);
  for (const MotionKind kind : {MotionKind::rotate, MotionKind::tumble, MotionKind::blend}) {
    const MotionOptions options{.kind = kind, .degrees = 90, .stop = 10};
    Motion motion(options, layout, a, &b);
    for (int frame = 0; frame <= 10; frame += 5) {
      LightState state;
      state.to = 1;
      state.rotation = motion_rotation(options, frame);
      if (kind == MotionKind::blend) state.blend = frame / 10.0;
      const auto expected = motion.coefficients(frame);
      const auto got = rig.coefficients(state);
      for (std::size_t i = 0; i < got.size(); ++i) {
        ASSERT_EQ(got[i], expected[i]) << motion_name(kind) << " frame " << frame << " at " << i;
      }
    }
  }
}

// A disc's energy: radiance times the solid angle of its cone, 2 pi (1 - cos), whatever texels it
// falls on. The rim is sampled by a grid of 512 a face: an area error of a sample's width along the
// rim at most, 2 / 512 of the circumference 2 pi sin, if every sample erred the same way.
TEST(LightRig, DiscsCarryTheEnergyOfTheirCone) {
  const int n = 16;
  const std::vector<double> solid_angles = cube_solid_angles(n);
  for (const double half_angle : {0.03, 0.2, 1.0, 2.5}) {
    for (const Vec3& towards : {Vec3{0, 1, 0}, Vec3{1, 1, 1}, Vec3{0.3, -0.2, 0.9}}) {
      Cubemap map(n);
      add_disc_light({normalize(towards), half_angle, {2, 1, 0}}, map);
      RgbD energy;
      for (std::size_t i = 0; i < map.texels.size(); ++i) {
        energy += RgbD(map.texels[i]) * solid_angles[i % solid_angles.size()];
      }
      const double expected = 2 * kPi * (1 - std::cos(half_angle));
      const double tolerance = 2 * kPi * std::sin(half_angle) * 2 / 512;
      EXPECT_NEAR(energy.r, 2 * expected, 2 * tolerance) << half_angle;
      EXPECT_NEAR(energy.g, expected, tolerance) << half_angle;
      EXPECT_EQ(energy.b, 0);
    }
  }
}

TEST(LightRig, IsLinearInItsParts) {
  const HaarLayout layout(8);
  LightRig rig = rig_of_two(layout);
  LightState all;
  all.to = 1;
  all.blend = 0.25;
  all.background = 3;
  all.rotation = rotation_x(0.4) * rotation_y(1.1);
  all.discs = {{normalize({1, 2, 3}), 0.3, {5, 6, 7}}};
  const auto part = [&](double blend, double background, bool discs) {
    LightState state = all;
    state.blend = blend;
    state.background = background;
    if (!discs) state.discs.clear();
    return rig.cubemap(state).texels;
  };
  const auto whole = part(0.25, 3, true), a = part(0, 1, false), b = part(1, 1, false),
             disc = part(0, 0, true);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const RgbD expected = (RgbD(a[i]) * 0.75 + RgbD(b[i]) * 0.25) * 3.0 + RgbD(disc[i]);
    // Four roundings to float on the way.
    EXPECT_NEAR(whole[i].r, expected.r, 4 * 0x1p-24 * (expected.r + 1)) << i;
  }
}

TEST(LightRig, AnEnvironmentPutInAnothersPlaceIsSeenAtOnce) {
  const HaarLayout layout(4);
  LightRig rig = rig_of_two(layout);
  const auto before = rig.cubemap({}).texels;
  rig.set_environment(0, sky(2));
  LightState second;
  second.from = 1;
  const auto other = rig.cubemap(second).texels;
  EXPECT_NE(rig.cubemap({}).texels, before);
  EXPECT_EQ(rig.cubemap({}).texels, other);
}

TEST(LightRig, RefusesWhatIsOutOfRange) {
  LightRig rig = rig_of_two(HaarLayout(4));
  const auto refused = [&](const auto& change) {
    LightState state;
    change(state);
    EXPECT_THROW(rig.cubemap(state), Error);
  };
  refused([](LightState& s) { s.from = 2; });
  refused([](LightState& s) { s.blend = 0.5, s.to = -1; });
  refused([](LightState& s) { s.blend = 1.5; });
  refused([](LightState& s) { s.background = -1; });
  refused([](LightState& s) { s.background = std::numeric_limits<double>::quiet_NaN(); });
  refused([](LightState& s) { s.rotation.row[0].x = 1.001; });
  refused([](LightState& s) { s.rotation.row[2].z = -1; });  // a mirror
  refused([](LightState& s) { s.discs = {{{0, 2, 0}, 0.2, {1, 1, 1}}}; });
  refused([](LightState& s) { s.discs = {{{0, 1, 0}, 0.001, {1, 1, 1}}}; });
  refused([](LightState& s) { s.discs = {{{0, 1, 0}, 0.2, {1, -1, 1}}}; });
  EXPECT_THROW(rig.set_environment(3, sky(1)), Error);
}

}  // namespace
}  // namespace haarlight
