// The head of a journal: what goes in comes out, and damage anywhere is told.

#include "prt/journal_head.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "core/error.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

JournalHead picture_head() {
  JournalHead head;
  head.info.face_size = 32;
  head.info.width = 641, head.info.height = 359;
  head.info.camera = look_at({1.25, 2.5, 1.0 / 3}, {0, 0.1, 0}, 0.7, 641, 359);
  head.fingerprint = "0123456789abcdef";
  head.thresholds = {0.0f, 1e-5f, 1.0f / 3, 1e-4f, 0.125f};
  head.meta = "{\"options\":{\"face\":32}}";
  head.max_bytes = std::uint64_t{1} << 40 | 12345;
  head.shard = {2, 5};
  head.tiles = 3645;
  return head;
}

JournalHead mesh_head() {
  JournalHead head = picture_head();
  const auto small = fixtures::small_mesh_transport(8, fixtures::bumpy_sphere(60, 3), 4);
  head.info = small.info;
  head.thresholds = {0.0f, 1e-5f, 1.0f / 3};
  return head;
}

void expect_equal(const JournalHead& a, const JournalHead& b) {
  EXPECT_EQ(a.info.kind, b.info.kind);
  EXPECT_EQ(a.info.face_size, b.info.face_size);
  EXPECT_EQ(a.info.width, b.info.width);
  EXPECT_EQ(a.info.height, b.info.height);
  EXPECT_EQ(a.info.terms, b.info.terms);
  EXPECT_EQ(a.info.camera.position, b.info.camera.position);
  EXPECT_EQ(a.info.camera.orientation, b.info.camera.orientation);
  EXPECT_EQ(a.info.camera.vertical_fov, b.info.camera.vertical_fov);
  EXPECT_EQ(a.fingerprint, b.fingerprint);
  EXPECT_EQ(a.thresholds, b.thresholds);
  EXPECT_EQ(a.meta, b.meta);
  EXPECT_EQ(a.max_bytes, b.max_bytes);
  EXPECT_EQ(a.shard.index, b.shard.index);
  EXPECT_EQ(a.shard.count, b.shard.count);
  EXPECT_EQ(a.tiles, b.tiles);
  ASSERT_EQ(a.info.mesh == nullptr, b.info.mesh == nullptr);
  if (!a.info.mesh) return;
  EXPECT_EQ(a.info.mesh->origin, b.info.mesh->origin);
  EXPECT_EQ(a.info.mesh->position, b.info.mesh->position);
  EXPECT_EQ(a.info.mesh->normal, b.info.mesh->normal);
  EXPECT_EQ(a.info.mesh->triangle, b.info.mesh->triangle);
}

// Every number to the bit, doubles that no short decimal has among them.
TEST(JournalHead, ComesBackAsItWas) {
  for (const JournalHead& head : {picture_head(), mesh_head()}) {
    const std::vector<std::byte> bytes = pack_head(head);
    EXPECT_EQ(packed_head_size(std::span(bytes).first(kHeadFixedBytes)), bytes.size());
    expect_equal(unpack_head(bytes, "a.partial"), head);
    EXPECT_TRUE(same_run(unpack_head(bytes, "a.partial"), head));
  }
}

// A damaged byte, anywhere, is a format error that names the file; so is a head that is cut short.
TEST(JournalHead, DamageIsTold) {
  const std::vector<std::byte> bytes = pack_head(picture_head());
  const auto expect_refused = [](const std::vector<std::byte>& damaged, std::size_t at) {
    try {
      unpack_head(damaged, "a.partial");
      ADD_FAILURE() << "byte " << at << " may be anything";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::format);
      EXPECT_EQ(std::string(error.what()).rfind("a.partial: ", 0), 0u) << error.what();
    }
  };
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::vector<std::byte> damaged = bytes;
    damaged[at] ^= std::byte{0x10};
    expect_refused(damaged, at);
  }
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{8}, kHeadFixedBytes, bytes.size() - 1}) {
    expect_refused({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}, size);
  }
  // Sizes that no memory has are none of ours, before anybody asks for them.
  std::vector<std::byte> huge(bytes.begin(), bytes.begin() + kHeadFixedBytes);
  huge[15] = std::byte{0x7f};
  EXPECT_EQ(packed_head_size(huge), 0u);
}

// Tiles go together only if everything that they depend on is the same; shards and descriptions,
// which may name another folder, are not of that.
TEST(JournalHead, KnowsItsOwnRun) {
  const JournalHead head = picture_head();
  const auto changed = [&](auto change) {
    JournalHead other = head;
    change(other);
    return same_run(head, other);
  };
  EXPECT_TRUE(changed([](JournalHead& h) { h.shard = {1, 5}; }));
  EXPECT_TRUE(changed([](JournalHead& h) { h.meta = "{}"; }));
  EXPECT_FALSE(changed([](JournalHead& h) { h.fingerprint += "0"; }));
  EXPECT_FALSE(changed([](JournalHead& h) { h.thresholds[1] = 2e-5f; }));
  EXPECT_FALSE(changed([](JournalHead& h) { h.info.width = 640; }));
  EXPECT_FALSE(changed([](JournalHead& h) { h.info.face_size = 64; }));
  EXPECT_FALSE(changed([](JournalHead& h) { h.max_bytes = 0; }));
}

}  // namespace
}  // namespace haarlight
