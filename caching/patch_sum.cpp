// Equation 4 for the points of a picture, patch by patch.

#include "caching/patch_sum.h"

#include <algorithm>

#include "core/parallel.h"

namespace haarlight {
namespace {

// Points are taken together up to so much of a record's reach apart, or where there are few.
constexpr float kApart = 0.5f;
constexpr std::size_t kFew = 8;

class Patch {
 public:
  Patch(const RecordIndex& index, const RecordReach& reach,
        const std::function<void(std::uint32_t)>& use)
      : index_(index), reach_(reach), use_(use) {}

  void add(const SurfacePoint& p, double per_unit, RecordSum& sum) {
    point_.push_back({surface_coordinates(p.position, p.normal, per_unit), &sum});
  }
  void sum() {
    if (!point_.empty()) split(point_);
  }

 private:
  void split(std::span<WeightedPoint> points) {
    SurfaceBox box = SurfaceBox::nothing();
    for (const WeightedPoint& p : points) box.add(p.at);
    const std::size_t axis = box.widest();
    if (points.size() > kFew && box.width(axis) > kApart * reach_.far) {
      const float middle = box.low[axis] + 0.5f * box.width(axis);
      const auto second = std::partition(points.begin(), points.end(), [&](const WeightedPoint& p) {
        return p.at[axis] < middle;
      });
      const auto count = static_cast<std::size_t>(second - points.begin());
      if (count > 0 && count < points.size()) {
        split(points.first(count)), split(points.subspan(count));
        return;
      }
    }
    near_.clear();
    index_.near(box, reach_.far, near_);
    if (near_.empty()) return;
    used_.assign(near_.size(), 0);
    add_records(near_, points, reach_, used_.data());
    for (std::size_t b = 0; b < near_.size(); ++b) {
      for (std::size_t i = 0; i < 8; ++i) {
        if (used_[b] >> i & 1u) use_(near_[b]->number[i]);
      }
    }
  }

  const RecordIndex& index_;
  const RecordReach& reach_;
  const std::function<void(std::uint32_t)>& use_;
  std::vector<WeightedPoint> point_;
  std::vector<const RecordBlock*> near_;
  std::vector<std::uint8_t> used_;  // of near_, a bit a record
};

}  // namespace

void add_patches(const RecordIndex& index, std::span<const SurfaceRow> rows, double per_unit,
                 const RecordReach& reach, const std::function<void(std::uint32_t)>& use,
                 std::vector<std::vector<RecordSum>>& sums) {
  if (index.empty() || rows.empty()) return;
  const int width = rows[0].width(), height = static_cast<int>(rows.size());
  const int across = (width + kPatch - 1) / kPatch, down = (height + kPatch - 1) / kPatch;
  parallel_for(across * down, [&](int n) {
    Patch patch(index, reach, use);
    const int left = n % across * kPatch, right = std::min(left + kPatch, width);
    for (int y = n / across * kPatch; y < std::min(n / across * kPatch + kPatch, height); ++y) {
      const auto line = static_cast<std::size_t>(y);
      const SurfaceRow& row = rows[line];
      const std::size_t end = row.first[static_cast<std::size_t>(right)];
      for (std::size_t i = row.first[static_cast<std::size_t>(left)]; i < end; ++i) {
        patch.add(row.point[i], per_unit, sums[line][i]);
      }
    }
    patch.sum();
  });
}

}  // namespace haarlight
