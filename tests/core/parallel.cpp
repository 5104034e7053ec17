// Parallel loops: each index once, exceptions come out, any number of threads.

#include "core/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "core/error.h"

namespace haarlight {
namespace {

class Parallel : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { set_thread_count(GetParam()); }
  void TearDown() override { set_thread_count(before_); }

 private:
  const int before_ = thread_count();
};

TEST_P(Parallel, RunsEachIndexOnce) {
  EXPECT_EQ(thread_count(), GetParam());
  for (const int count : {0, 1, 2, 7, 1000}) {
    for (const int chunk : {1, 3, 64, 5000}) {
      std::vector<int> runs(static_cast<std::size_t>(count), 0);
      parallel_for(
          count, [&](int i) { ++runs[static_cast<std::size_t>(i)]; }, chunk);
      EXPECT_EQ(runs, std::vector<int>(static_cast<std::size_t>(count), 1))
          << count << " by " << chunk;
    }
  }
}

TEST_P(Parallel, ThrowsWhatABodyThrew) {
  for (int round = 0; round < 20; ++round) {
    try {
      parallel_for(1000, [&](int i) {
        if (i % 10 == 3) throw Error(ErrorKind::format, "index ends in 3");
      });
      FAIL() << "no exception";
    } catch (const Error& error) {
      EXPECT_STREQ(error.what(), "index ends in 3");
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, Parallel, testing::Values(1, 2, 7));

TEST(ParallelOptions, FewerThanOneThreadIsRefused) {
  const int before = thread_count();
  EXPECT_THROW(set_thread_count(0), Error);
  EXPECT_THROW(set_thread_count(-3), Error);
  EXPECT_EQ(thread_count(), before);
}

}  // namespace
}  // namespace haarlight
