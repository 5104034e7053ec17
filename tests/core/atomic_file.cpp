// Files that appear whole or not at all.

#include "core/atomic_file.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/error.h"
#include "tests/core/temporary_folder.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

TEST(AtomicFile, IsThereOnlyAfterCommit) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.hlt";
  {
    AtomicFile out(file);
    out.write("0123456789", 10);
    EXPECT_FALSE(fs::exists(file));
    out.write_at(2, "ab", 2);
    EXPECT_EQ(out.size(), 10u) << "a write inside does not move the end";
    out.write("xyz", 3);
    EXPECT_EQ(out.size(), 13u);
    out.commit();
    EXPECT_EQ(read_bytes(file), "01ab456789xyz");
  }
  EXPECT_EQ(read_bytes(file), "01ab456789xyz");
  EXPECT_EQ(folder.entries(), Names{"a.hlt"});
}

TEST(AtomicFile, WithoutCommitLeavesWhatWasThere) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.hlt";
  write_bytes(file, "old");
  {
    AtomicFile out(file);
    out.write("new", 3);
  }
  EXPECT_EQ(read_bytes(file), "old");
  EXPECT_EQ(folder.entries(), Names{"a.hlt"});
}

TEST(AtomicFile, TwoWritersOfOneNameDoNotMix) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.hlt";
  AtomicFile first(file), second(file);
  first.write("first", 5);
  second.write("second", 6);
  second.commit();
  EXPECT_EQ(read_bytes(file), "second");
  first.commit();
  EXPECT_EQ(read_bytes(file), "first");
}

TEST(AtomicFile, SecondCommitAndLateWriteAreRefused) {
  const TemporaryFolder folder;
  AtomicFile out(folder / "a.hlt");
  out.commit();
  EXPECT_THROW(out.commit(), Error);
  EXPECT_THROW(out.write("a", 1), Error);
}

void expect_io_error_naming(const fs::path& file) {
  try {
    AtomicFile out(file);
    ADD_FAILURE() << file << " was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io) << error.what();
    EXPECT_EQ(std::string(error.what()).rfind(file.string() + ": ", 0), 0u) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

TEST(AtomicFile, RefusesPlacesThatCannotHoldAFile) {
  const TemporaryFolder folder;
  write_bytes(folder / "plain", "x");
  expect_io_error_naming(folder.path());
  expect_io_error_naming(folder / "missing" / "a.hlt");
  expect_io_error_naming(folder / "plain" / "a.hlt");
  // As root a rename over the device would work, and the machine would be without it.
  expect_io_error_naming("/dev/null");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(folder.entries(), Names{"plain"});
}

TEST(AtomicFile, FollowsALink) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "elsewhere");
  write_bytes(folder / "elsewhere" / "real.hlt", "old");
  fs::create_symlink(folder / "elsewhere" / "real.hlt", folder / "link.hlt");
  AtomicFile out(folder / "link.hlt");
  out.write("new", 3);
  out.commit();
  EXPECT_TRUE(fs::is_symlink(folder / "link.hlt"));
  EXPECT_EQ(read_bytes(folder / "elsewhere" / "real.hlt"), "new");
}

}  // namespace
}  // namespace haarlight
