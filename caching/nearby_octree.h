// Which records of one reach are near a place: an octree whose leaves hold all they need.

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// Numbered places with normals, each kept in every leaf that its reach touches, so that a place
/// asks one leaf. All have the same reach, and leaves are between half of it and all of it wide:
/// few enough for each record, and a leaf has few records that are too far off. Coincident records
/// share leaves and split nothing: no deeper than kDeepest whatever comes.
class NearbyOctree {
 public:
  static constexpr int kDeepest = 24;

  /// The root is the cube of `half_edge` > 0 about the origin; what is beyond it is not found.
  NearbyOctree(double half_edge, double reach) : half_edge_(half_edge), reach_(reach), node_(1) {
    while (levels_ < kDeepest && std::ldexp(2 * half_edge, -levels_) > reach) ++levels_;
  }

  struct Entry {
    std::array<float, 3> position{}, normal{};
    std::uint32_t number = 0;
  };

  void insert(std::uint32_t number, const Vec3& position, const Vec3& normal) {
    const Entry entry{
        {static_cast<float>(position.x), static_cast<float>(position.y),
         static_cast<float>(position.z)},
        {static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)},
        number};
    insert(0, 0, {0, 0, 0}, position, entry);
  }

  /// The entries of the leaf that holds `place`: all within reach are among them.
  const std::vector<Entry>& near(const Vec3& place) const {
    Vec3 middle;
    std::size_t n = 0;
    double half = half_edge_;
    for (int level = 0; level < levels_; ++level) {
      const std::size_t o = (place.x >= middle.x) | std::size_t{place.y >= middle.y} << 1 |
                            std::size_t{place.z >= middle.z} << 2;
      const std::int32_t next = node_[n][o];
      if (next < 0) return none_;
      half *= 0.5;
      middle = child_middle(middle, half, o);
      n = static_cast<std::size_t>(next);
    }
    if (levels_ == 0) return leaf_.empty() ? none_ : leaf_[0];
    return leaf_[n];
  }

  int levels() const { return levels_; }
  std::size_t leaves() const { return leaf_.size(); }

 private:
  static Vec3 child_middle(const Vec3& middle, double half, std::size_t o) {
    return middle + Vec3{o & 1 ? half : -half, o & 2 ? half : -half, o & 4 ? half : -half};
  }

  void insert(std::size_t node, int level, const Vec3& middle, const Vec3& place,
              const Entry& entry) {
    if (level == levels_) {
      if (leaf_.empty()) leaf_.emplace_back();
      leaf_[node].push_back(entry);
      return;
    }
    const double half = std::ldexp(half_edge_, -level - 1);
    for (std::size_t o = 0; o < 8; ++o) {
      const Vec3 m = child_middle(middle, half, o);
      const auto beyond = [&](double a, double b) { return std::max(std::abs(a - b) - half, 0.0); };
      const Vec3 gap{beyond(place.x, m.x), beyond(place.y, m.y), beyond(place.z, m.z)};
      // Room for positions that are compared in single precision: coordinates below 2, twice.
      constexpr double kRounding = 0x1p-22;
      if (dot(gap, gap) > 1.0001 * reach_ * reach_ + kRounding * kRounding) continue;
      if (node_[node][o] < 0) {
        const bool to_leaf = level + 1 == levels_;
        node_[node][o] = static_cast<std::int32_t>(to_leaf ? leaf_.size() : node_.size());
        if (to_leaf) {
          leaf_.emplace_back();
        } else {
          node_.emplace_back();
        }
      }
      insert(static_cast<std::size_t>(node_[node][o]), level + 1, m, place, entry);
    }
  }

  struct Node : std::array<std::int32_t, 8> {
    Node() { fill(-1); }
  };
  double half_edge_, reach_;
  int levels_ = 0;
  std::vector<Node> node_;  // [0]: the root
  std::vector<std::vector<Entry>> leaf_;
  std::vector<Entry> none_;
};

}  // namespace haarlight
