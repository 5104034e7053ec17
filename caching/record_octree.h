// Which records reach a place.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// Numbered spheres in an octree (Ward 1988): each is kept at the level whose cubes are at least
/// twice its radius wide, in the up to eight cubes it touches, so that a place asks one cube a
/// level. No deeper than kDeepest however small or however many spheres there are.
class RecordOctree {
 public:
  static constexpr int kDeepest = 24;

  /// `center` and half the edge of the cube that is the root, > 0. Places beyond it belong to its
  /// nearest cubes.
  RecordOctree(const Vec3& center, double half_edge);

  /// The tightest one about points, of which there is at least one.
  static RecordOctree around(const std::vector<Vec3>& points);

  /// Requires radius >= 0 and finite numbers.
  void insert(std::uint32_t number, const Vec3& position, double radius);

  /// visit(number) for every sphere that may hold `place`, in an order that insertions alone
  /// decide; all that do are among them.
  template <typename Visit>
  void visit(const Vec3& place, const Visit& visit) const;

  int depth() const { return depth_; }
  std::size_t cells() const { return cell_.size(); }

 private:
  struct Cell {
    std::array<std::int32_t, 8> child{-1, -1, -1, -1, -1, -1, -1, -1};
    std::vector<std::uint32_t> record;
  };
  // Coordinates in [0, 2^kDeepest) along each axis.
  std::array<std::uint32_t, 3> address(const Vec3& place) const;
  static std::size_t octant(const std::array<std::uint32_t, 3>& at, int level) {
    const int bit = kDeepest - 1 - level;
    return (at[0] >> bit & 1) | (at[1] >> bit & 1) << 1 | (at[2] >> bit & 1) << 2;
  }

  Vec3 low_;
  double edge_;
  int depth_ = 0;
  std::vector<Cell> cell_;
};

template <typename Visit>
void RecordOctree::visit(const Vec3& place, const Visit& visit) const {
  const auto at = address(place);
  std::size_t cell = 0;
  for (int level = 0;; ++level) {
    for (const std::uint32_t number : cell_[cell].record) visit(number);
    if (level == kDeepest) return;
    const std::int32_t next = cell_[cell].child[octant(at, level)];
    if (next < 0) return;
    cell = static_cast<std::size_t>(next);
  }
}

}  // namespace haarlight
