// The irradiance cache.

#include "caching/irradiance_cache.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

namespace haarlight {

void IrradianceCache::clear() {
  record_.clear(), live_.clear(), used_.clear();
  scene_ = nullptr;
}

void IrradianceCache::begin(int frame, const Scene& scene) {
  frame_ = frame, scene_ = &scene;
  live_.clear(), used_.clear();
  Vec3 low = scene.position.front(), high = low;
  for (const Vec3& p : scene.position) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3 size = high - low;
  const double edge = std::max({size.x, size.y, size.z});
  octree_ = RecordOctree((low + high) * 0.5, edge > 0 ? edge / 2 : 1);
  for (std::uint32_t i = 0; i < record_.size(); ++i) {
    const CacheRecord& r = record_[i];
    if (r.born <= frame && frame < r.born + r.life) add_live(i, scene);
  }
}

void IrradianceCache::add_live(std::uint32_t number, const Scene& scene) {
  const CacheRecord& r = record_[number];
  const int age = frame_ - r.born;
  Live live{number, place_in(scene, r.place), r.value, r.radius, static_cast<double>(r.life - age)};
  if (age > 0) live.value += r.change * age;
  octree_.insert(static_cast<std::uint32_t>(live_.size()), live.at.position,
                 accuracy_ * live.radius);
  live_.push_back(live);
  used_.push_back(0);
}

std::uint32_t IrradianceCache::add(const CacheRecord& added, double least) {
  CacheRecord record = added;
  const PlaceFrame at = place_in(*scene_, record.place);
  const auto distance = [&](const Live& other) { return length(other.at.position - at.position); };
  octree_.visit(at.position, [&](std::uint32_t i) {
    record.radius = std::min(record.radius, live_[i].radius + distance(live_[i]));
  });
  record.radius = std::max(record.radius, least);
  octree_.visit(at.position, [&](std::uint32_t i) {
    Live& other = live_[i];
    const double limit = std::max(record.radius + distance(other), least);
    if (!(limit < other.radius)) return;
    other.radius = limit;
    record_[other.record].radius = limit;
  });
  record_.push_back(record);
  const auto number = static_cast<std::uint32_t>(record_.size() - 1);
  add_live(number, *scene_);
  return number;
}

bool IrradianceCache::covers(const Vec3& position, const Vec3& normal) const {
  bool found = false;
  octree_.visit(position, [&](std::uint32_t i) {
    found = found || record_error(live_[i].at, live_[i].radius, position, normal) < accuracy_;
  });
  return found;
}

void IrradianceCache::mark(std::size_t live) const {
  std::atomic_ref<std::uint8_t>(used_[live]).store(1, std::memory_order_relaxed);
}

std::optional<IrradianceCache::Found> IrradianceCache::at(const Vec3& position, const Vec3& normal,
                                                          const Vec3& shading) const {
  Found found;
  double weights = 0;
  octree_.visit(position, [&](std::uint32_t i) {
    const Live& live = live_[i];
    const double w = record_weight(record_error(live.at, live.radius, position, normal), accuracy_);
    if (!(w > 0)) return;
    weights += w;
    found.irradiance += extrapolated(live.at, live.value, position, shading) * w;
    found.left += live.left * w;
    mark(i);
  });
  if (weights > 0) {
    found.irradiance *= 1 / weights, found.left /= weights;
    return found;
  }
  // Neighbours have been clamped since this place was covered.
  std::size_t nearest = live_.size();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < live_.size(); ++i) {
    const double error = record_error(live_[i].at, live_[i].radius, position, normal);
    if (error < least) least = error, nearest = i;
  }
  if (nearest == live_.size()) return std::nullopt;
  mark(nearest);
  return Found{extrapolated(live_[nearest].at, live_[nearest].value, position, shading),
               live_[nearest].left};
}

void IrradianceCache::note_use() {
  for (std::size_t i = 0; i < live_.size(); ++i) {
    if (used_[i]) record_[live_[i].record].last_used = frame_;
  }
}

std::vector<std::uint32_t> IrradianceCache::alive() const {
  std::vector<std::uint32_t> out;
  for (const Live& live : live_) out.push_back(live.record);
  return out;
}

}  // namespace haarlight
