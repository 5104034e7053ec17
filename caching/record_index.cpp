// Which records are near a patch of surface.

#include "caching/record_index.h"

#include <algorithm>
#include <limits>

namespace haarlight {
SurfaceCoordinates surface_coordinates(const Vec3& position, const Vec3& normal, double per_unit) {
  constexpr double kTurn = 0.70710678118654752;
  const auto f = [](double x) { return static_cast<float>(x); };
  return {f(position.x * per_unit), f(position.y * per_unit), f(position.z * per_unit), 0,
          f(normal.x * kTurn),      f(normal.y * kTurn),      f(normal.z * kTurn),      0};
}

SurfaceBox SurfaceBox::nothing() {
  constexpr float kMax = std::numeric_limits<float>::max();
  SurfaceBox box;
  box.low.fill(kMax), box.high.fill(-kMax);
  return box;
}

void SurfaceBox::add(const SurfaceCoordinates& c) {
  for (std::size_t a = 0; a < 8; ++a) {
    low[a] = std::min(low[a], c[a]), high[a] = std::max(high[a], c[a]);
  }
}

std::size_t SurfaceBox::widest() const {
  std::size_t widest = 0;
  for (std::size_t a = 1; a < 8; ++a) {
    if (width(a) > width(widest)) widest = a;
  }
  return widest;
}

bool SurfaceBox::beyond(const SurfaceBox& other, float reach) const {
  float square[8];
  for (std::size_t a = 0; a < 8; ++a) {
    float d = low[a] - other.high[a];
    d = std::max(d, other.low[a] - high[a]);
    d = std::max(d, 0.0f);
    square[a] = d * d;
  }
  const float way = (square[0] + square[1]) + square[2];
  const float turn = (square[4] + square[5]) + square[6], most = reach * reach;
  // sqrt(way) + sqrt(turn) > reach, without roots where one part alone says so.
  if (way > most || turn > most) return true;
  const float rest = most - way - turn;
  return rest < 0 || 4 * way * turn > rest * rest;
}

void RecordIndex::build(std::vector<Entry> entries) {
  node_.clear(), block_.clear();
  if (entries.empty()) return;
  node_.emplace_back();
  split(0, entries);
}

void RecordIndex::split(std::size_t node, std::span<Entry> entries) {
  Node here;
  here.box = SurfaceBox::nothing();
  for (const Entry& e : entries) here.box.add(e.at);
  if (entries.size() > 8) {
    const std::size_t axis = here.box.widest();
    // Whole blocks on one side.
    const std::size_t half = (entries.size() / 2 + 7) / 8 * 8;
    std::nth_element(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(half),
                     entries.end(),
                     [axis](const Entry& a, const Entry& b) { return a.at[axis] < b.at[axis]; });
    here.child = static_cast<std::uint32_t>(node_.size());
    node_.resize(node_.size() + 2);
    split(here.child, entries.first(half)), split(here.child + 1, entries.subspan(half));
  } else {
    here.block = static_cast<std::uint32_t>(block_.size());
    RecordBlock block;
    block.size = static_cast<std::uint32_t>(entries.size());
    for (auto& at : block.at) at.fill(RecordBlock::kNowhere);
    for (std::size_t i = 0; i < entries.size(); ++i) {
      block.number[i] = entries[i].number;
      for (std::size_t a = 0; a < 6; ++a) block.at[a][i] = entries[i].at[a < 3 ? a : a + 1];
    }
    block_.push_back(block);
  }
  node_[node] = here;
}

void RecordIndex::near(const SurfaceBox& box, float reach,
                       std::vector<const RecordBlock*>& out) const {
  if (node_.empty()) return;
  // Room for the rounding of distances between numbers below a few units.
  const float room = reach * 1.001f + 1e-5f;
  std::array<std::uint32_t, 64> waiting;  // depth is at most 32
  std::size_t count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const Node& node = node_[waiting[--count]];
    if (node.box.beyond(box, room)) continue;
    if (node.child != 0) {
      waiting[count++] = node.child + 1, waiting[count++] = node.child;
    } else {
      out.push_back(&block_[node.block]);
    }
  }
}

}  // namespace haarlight
