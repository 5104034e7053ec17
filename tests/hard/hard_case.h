// What a hard case's test measured, beside what is allowed: in the failure message, and in the
// report that docs/stability.md is made from (tests/hard/stability_table.py).

#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace haarlight::hard {

/// What the row asserts, in a few words. The first line of each test.
inline void property(const std::string& text) { ::testing::Test::RecordProperty("property", text); }

/// Whether the long versions were asked for (HAARLIGHT_HARD_FULL=1).
inline bool full() {
  const char* asked = std::getenv("HAARLIGHT_HARD_FULL");
  return asked && *asked != '\0' && *asked != '0';
}

/// Keeps "what|figure|relation|limit" for the report.
inline void record(const std::string& what, double figure, const char* relation, double limit) {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  const int before = test->result()->test_property_count();
  ::testing::Test::RecordProperty(
      fmt::format("figure_{}", before),
      fmt::format("{}|{:.3g}|{}|{:.3g}", what, figure, relation, limit));
}

/// Expects figure <= limit; a NaN fails. A limit of 0 is for counts of what must not be.
inline void at_most(const std::string& what, double figure, double limit) {
  record(what, figure, "<=", limit);
  EXPECT_LE(figure, limit) << what << ": " << figure << ", at most " << limit << " is allowed";
}

/// Expects figure >= limit: that a case was met at all.
inline void at_least(const std::string& what, double figure, double limit) {
  record(what, figure, ">=", limit);
  EXPECT_GE(figure, limit) << what << ": " << figure << ", at least " << limit << " is wanted";
}

}  // namespace haarlight::hard
