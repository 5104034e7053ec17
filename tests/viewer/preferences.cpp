// What is remembered comes back; what is damaged is forgotten.

#include "viewer/preferences.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "core/error.h"
#include "tests/core/temporary_folder.h"

namespace haarlight::viewer {
namespace {

TEST(Preferences, ComeBack) {
  const TemporaryFolder folder;
  Preferences p;
  p.width = 1500;
  p.height = 700;
  p.plots = false;
  p.curve = "linear";
  p.transport = "/a/b c.hlt";
  p.env = "/d.exr";
  p.folder = "/e";
  const auto file = folder / "deep" / "er" / "viewer.json";
  save_preferences(file, p);
  const Preferences back = load_preferences(file);
  EXPECT_EQ(back.width, p.width);
  EXPECT_EQ(back.height, p.height);
  EXPECT_EQ(back.panels, p.panels);
  EXPECT_EQ(back.plots, p.plots);
  EXPECT_EQ(back.curve, p.curve);
  EXPECT_EQ(back.transport, p.transport);
  EXPECT_EQ(back.env, p.env);
  EXPECT_EQ(back.folder, p.folder);
}

TEST(Preferences, DamageGivesAFirstRun) {
  const TemporaryFolder folder;
  const int first = Preferences{}.width;
  for (const char* text : {"", "{", "[]", "3", R"({"width": "wide"})", R"({"panels": 7})"}) {
    write_bytes(folder / "p.json", text);
    EXPECT_EQ(load_preferences(folder / "p.json").width, first) << text;
  }
  EXPECT_EQ(load_preferences(folder / "none.json").width, first);
  write_bytes(folder / "p.json", R"({"width": 1, "height": 1000000})");
  EXPECT_EQ(load_preferences(folder / "p.json").width, 320);
  EXPECT_EQ(load_preferences(folder / "p.json").height, 16384);
  EXPECT_THROW(save_preferences("/proc/no/folder.json", {}), Error);
}

TEST(Preferences, LieWhereTheDesktopWantsThem) {
  ::setenv("XDG_CONFIG_HOME", "/x", 1);
  EXPECT_EQ(preferences_file(), "/x/haarlight/viewer.json");
  ::unsetenv("XDG_CONFIG_HOME");
  ::setenv("HOME", "/h", 1);
  EXPECT_EQ(preferences_file(), "/h/.config/haarlight/viewer.json");
  ::unsetenv("HOME");
  EXPECT_TRUE(preferences_file().empty());
}

}  // namespace
}  // namespace haarlight::viewer
