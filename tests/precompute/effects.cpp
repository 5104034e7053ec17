// Lists of effects in words.

#include "precompute/effects.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace haarlight {
namespace {

TEST(Effects, WordsAndBack) {
  for (int bits = 0; bits < 32; ++bits) {
    for (const int bounces : {0, 1, 7, kMostBounces}) {
      const Effects e{(bits & 1) != 0, bounces,         (bits & 2) != 0,
                      (bits & 4) != 0, (bits & 8) != 0, (bits & 16) != 0};
      EXPECT_EQ(parse_effects(to_string(e)), e) << to_string(e);
    }
  }
  EXPECT_EQ(parse_effects("all"), all_effects());
  EXPECT_EQ(parse_effects("interreflection").bounces, kMostBounces);
  EXPECT_FALSE(parse_effects("none").shadows);
}

TEST(Effects, RefusesWhatIsNoEffectByName) {
  for (const char* list : {"", "shadow", "shadows,", "shadows,,gloss", "interreflection=0",
                           "interreflection=65", "interreflection=x", "interreflection=3x"}) {
    try {
      parse_effects(list);
      ADD_FAILURE() << list;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::invalid_argument);
      EXPECT_NE(std::string(e.what()).find("expected all, none, or a list of shadows"),
                std::string::npos);
    }
  }
}

}  // namespace
}  // namespace haarlight
