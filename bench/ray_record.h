// What rays a piece of work sends through Embree, to send the same again with nothing around them.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#if HAARLIGHT_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace haarlight::bench {

/// Rays in the order in which they were traced.
struct RayRecord {
  enum class Call : std::uint8_t { intersect_one, occluded_one, occluded_eight };
  struct One {
    float origin[3], direction[3], distance;
    unsigned mask;
  };
  struct Eight {  // of one origin, as Visibility traces them
    float origin[3], distance;
    float x[8], y[8], z[8];
    unsigned mask, lanes;
  };

  RTCScene scene = nullptr;
  std::vector<Call> call;
  std::vector<One> one;
  std::vector<Eight> eight;
  std::int64_t rays = 0;  ///< lanes of packets that are off do not count
  std::int64_t hits = 0;  ///< of them, that met something

  std::size_t bytes() const {
    return call.size() * sizeof(Call) + one.size() * sizeof(One) + eight.size() * sizeof(Eight);
  }
};

/// While one lives, every ray that the program traces is written down; one at a time, and only the
/// thread that made it may trace.
class Recording {
 public:
  explicit Recording(RayRecord& record);
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
};

/// Traces all rays of `record` again by bare calls of Embree; returns how many met something.
std::int64_t replay(const RayRecord& record);

}  // namespace haarlight::bench
