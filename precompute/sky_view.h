// What a place sees of one phase of the sky, by parts of its BSDF.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/bsdf.h"
#include "precompute/lobe_lanes.h"
#include "precompute/sparse_directions.h"
#include "precompute/visibility.h"

namespace haarlight {

/// The directions of one packet list that a place sees; reused from place to place.
class SkyView {
 public:
  /// Traces rays from `from`, local and off a surface of BSDF `b`, through all directions of
  /// `packets` above both horizons; what they `see` blocks. Adds to `rays`.
  void look(const Visibility& visibility, const Vec3& from, const Bsdf& b,
            const SparseDirections::Packet* packets, std::size_t count, std::int64_t& rays,
            Visibility::Surfaces see = Visibility::kAll);

  /// Bit p: packet p has directions that are open, or blocked.
  std::uint64_t open() const { return open_; }
  std::uint64_t blocked() const { return blocked_; }
  unsigned blocked_lanes(std::size_t packet) const { return blocked_lanes_[packet]; }

  /// Bsdf::diffuse_in times weight for the open packets; others are left as they are.
  void diffuse(const Bsdf& b, float* values);
  /// lobe_values times weight, likewise; `second` may be null.
  void lobe(const Bsdf& b, float* first, float* second);

 private:
  static constexpr std::size_t kMost = 64;  // packets

  const SparseDirections::Packet* packets_ = nullptr;
  std::uint64_t open_ = 0, blocked_ = 0;
  std::array<std::uint8_t, kMost> lanes_{}, open_lanes_{}, blocked_lanes_{};
  alignas(32) std::array<float, 8 * kMost> cosine_{};
  CoatTables coats_;
};

}  // namespace haarlight
