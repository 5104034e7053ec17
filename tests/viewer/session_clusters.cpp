// A session over a compressed transport: light and view at once, and its clusters in colours.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "cpca/cluster_relighter.h"
#include "cpca/compress.h"
#include "prt/finish_rows.h"
#include "tests/cpca/inputs.h"
#include "tests/viewer/inputs.h"
#include "viewer/session.h"

namespace haarlight::viewer {
namespace {

using fixtures::TemporaryFolder;

// What a relighter of its own shows of the lighting that the session shows.
Image exact_picture(const Session& session) {
  const FrameRelighter& frames = *session.relighter();
  ClusterRelighter relighter(frames.transport(), {.basis_terms = -1});
  relighter.set_camera(frames.view().camera);
  relighter.set_exact(true);
  relighter.apply(full_update(frames.transport().layout(), frames.tracker().shown()));
  return relighter.picture();
}

TEST(SessionClusters, ComeToRestOnTheExactPictureFromAnySide) {
  const TemporaryFolder folder;
  const fixtures::SmallTransport small = fixtures::smooth_transport(8, 300, 1, false);
  compress_transport(build_transport(small.info, small.tiles, small.thresholds), folder / "c.hlt",
                     {.clusters = 7, .basis = 8});
  fixtures::write_sky(folder / "sky.exr", 1);
  Session session;
  session.act(OpenTransport{folder / "c.hlt"});
  session.act(OpenEnvironment{folder / "sky.exr"});
  ViewSettings settings;
  settings.wavelets = 12;
  ViewFrame frame;
  std::set<std::uint64_t> views;
  for (const double orbit : {0.0, 0.8, 2.5, 4.0}) {
    settings.playing = true;
    settings.orbit = orbit;
    std::uint64_t before = frame.number;
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(session.advance(settings, 1, frame));
      EXPECT_EQ(frame.number, ++before);
    }
    views.insert(frame.view_number);
    settings.playing = false;
    for (int i = 0; i < 400 && session.advance(settings, 1, frame); ++i) {
    }
    EXPECT_TRUE(session.resting(settings));
    EXPECT_TRUE(frame.converged);
    // Sums in double of at most 384 terms, rounded to float once; the same camera, the same pixels.
    const Image exact = exact_picture(session);
    float largest = 1;
    for (const Rgb& c : exact.pixels) largest = std::max(largest, l1_norm(c));
    ASSERT_EQ(frame.picture.pixels.size(), exact.pixels.size());
    double lit = 0;
    for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
      ASSERT_LE(l1_norm(frame.picture.pixels[i] - exact.pixels[i]), 1e-6f * largest) << i;
      lit += l1_norm(exact.pixels[i]) > 0;
    }
    EXPECT_GT(lit, 0);

    // Clusters in colours: of the pixels inside a cluster each has one of as many colours as there
    // are clusters; what was relit is left as it is.
    const Image relit = session.relighter()->picture();
    settings.clusters = true;
    ASSERT_TRUE(session.advance(settings, 1, frame));
    EXPECT_EQ(session.relighter()->picture().pixels, relit.pixels);
    EXPECT_NE(frame.picture.pixels, relit.pixels);
    std::map<std::tuple<float, float, float>, int> pixels;
    for (const Rgb& c : frame.picture.pixels) {
      if (l1_norm(c) > 0) ++pixels[{c.r, c.g, c.b}];
    }
    int areas = 0;
    for (const auto& [colour, count] : pixels) areas += count > 3;
    EXPECT_GT(areas, 1);
    EXPECT_LE(areas, session.relighter()->transport().info().clusters->clusters());
    settings.clusters = false;
  }
  EXPECT_EQ(views.size(), 4u);
}

}  // namespace
}  // namespace haarlight::viewer
