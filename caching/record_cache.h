// Records of light, those of one frame at hand: look up, mark, add.

#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <vector>

#include "caching/irradiance_record.h"
#include "caching/record_octree.h"
#include "precompute/scene.h"

namespace haarlight {

/// A record and the frames it is good for: born, born + 1, ... born + life - 1. Value is
/// RecordValue or RadianceValue: linear in light.
template <typename Value>
struct CacheRecord {
  BodyPlace place;
  std::uint64_t key = 0;  ///< of its random numbers; its successors have the same
  int born = 0, life = 1;
  double radius = 0;   ///< metres
  Value value;         ///< in frame `born`
  Value change;        ///< a frame (Gautron 2007, equations 13 to 20)
  int last_used = -1;  ///< the last frame whose picture it had a part in
  // Who asked for it first, or for the record that it replaces:
  std::int32_t lobe = 0;  ///< lobe_table_key(), of records of radiance
  Vec3 to_viewer;         ///< unit, world
};

/// All records of an animation. Looking up is safe from any number of threads, adding is not.
template <typename Value>
class RecordCache {
 public:
  using Record = CacheRecord<Value>;

  /// `accuracy`: a of equation 3 as Ward has it, the largest error, in (0, 1].
  explicit RecordCache(double accuracy) : accuracy_(accuracy) {}

  /// Goes to a frame: records that are good for it move to where their bodies are now. `scene` must
  /// outlive the frame.
  void begin(int frame, const Scene& scene);
  /// Forgets all records.
  void clear();

  /// Adds a record that is good for the frame at hand, and keeps it and its neighbours from
  /// reaching farther than the other reaches, plus the distance between them (neighbour clamping,
  /// Krivanek and others 2006), but none below `least` metres.
  void add(const Record& record, double least);

  /// Whether any record counts at a place of unit `normal` (world).
  bool covers(const Vec3& position, const Vec3& normal) const;

  /// visit(place, value, weight) for all records that count there, value as it is in this frame;
  /// the weights are those of equation 1, not yet divided by their sum. Where there is none, for
  /// the record of the least error, if any has a finite one. What is visited is marked as used.
  /// Returns for how many frames those records are still good, a weighted mean; 0 if there are
  /// none.
  template <typename Visit>
  double visit(const Vec3& position, const Vec3& normal, const Visit& visit) const;
  /// Writes down which records were used in this frame since begin().
  void note_use();

  const std::vector<Record>& records() const { return record_; }
  Record& record(std::uint32_t number) { return record_[number]; }
  /// Numbers of the records that are good for the frame at hand.
  std::vector<std::uint32_t> alive() const;
  std::size_t alive_count() const { return live_.size(); }

 private:
  struct Live {
    std::uint32_t record;
    PlaceFrame at;
    Value value;
    double radius, left;
  };
  void add_live(std::uint32_t number);
  double error(const Live& live, const Vec3& position, const Vec3& normal) const {
    return record_error(live.at, live.radius, position, normal);
  }
  void mark(std::size_t live) const {
    std::atomic_ref<std::uint8_t>(used_[live]).store(1, std::memory_order_relaxed);
  }

  double accuracy_;
  std::vector<Record> record_;
  int frame_ = 0;
  const Scene* scene_ = nullptr;
  std::vector<Live> live_;
  mutable std::vector<std::uint8_t> used_;  // by live number; any thread marks
  RecordOctree octree_{{}, 1};
};

/// The mean irradiance at a place (equation 1; W/m^2) for the unit normal `shading`, which may be
/// bumped; zero where no record says anything.
struct FoundIrradiance {
  RgbD irradiance;
  double left = 0;  ///< as visit() returns it
};
FoundIrradiance irradiance_at(const RecordCache<RecordValue>& cache, const Vec3& position,
                              const Vec3& normal, const Vec3& shading);

// Implementation of the template.

template <typename Value>
void RecordCache<Value>::clear() {
  record_.clear(), live_.clear(), used_.clear();
  scene_ = nullptr;
}

template <typename Value>
void RecordCache<Value>::begin(int frame, const Scene& scene) {
  frame_ = frame, scene_ = &scene;
  live_.clear(), used_.clear();
  octree_ = RecordOctree::around(scene.position);
  for (std::uint32_t i = 0; i < record_.size(); ++i) {
    const Record& r = record_[i];
    if (r.born <= frame && frame - r.born < r.life) add_live(i);
  }
}

template <typename Value>
void RecordCache<Value>::add_live(std::uint32_t number) {
  const Record& r = record_[number];
  const int age = frame_ - r.born;
  Live live{number, place_in(*scene_, r.place), r.value, r.radius,
            static_cast<double>(r.life - age)};
  if (age > 0) live.value += r.change * age;
  octree_.insert(static_cast<std::uint32_t>(live_.size()), live.at.position,
                 accuracy_ * live.radius);
  live_.push_back(std::move(live));
  used_.push_back(0);
}

template <typename Value>
void RecordCache<Value>::add(const Record& added, double least) {
  Record record = added;
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
  record_.push_back(std::move(record));
  add_live(static_cast<std::uint32_t>(record_.size() - 1));
}

template <typename Value>
bool RecordCache<Value>::covers(const Vec3& position, const Vec3& normal) const {
  bool found = false;
  octree_.visit(position, [&](std::uint32_t i) {
    found = found || error(live_[i], position, normal) < accuracy_;
  });
  return found;
}

template <typename Value>
template <typename Visit>
double RecordCache<Value>::visit(const Vec3& position, const Vec3& normal,
                                 const Visit& visit) const {
  double left = 0, weights = 0;
  octree_.visit(position, [&](std::uint32_t i) {
    const Live& live = live_[i];
    const double w = record_weight(error(live, position, normal), accuracy_);
    if (!(w > 0)) return;
    visit(live.at, live.value, w);
    left += live.left * w, weights += w;
    mark(i);
  });
  if (weights > 0) return left / weights;
  // Neighbours have been clamped since this place was covered.
  std::size_t nearest = live_.size();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < live_.size(); ++i) {
    const double e = error(live_[i], position, normal);
    if (e < least) least = e, nearest = i;
  }
  if (nearest == live_.size()) return 0;
  visit(live_[nearest].at, live_[nearest].value, 1.0);
  mark(nearest);
  return live_[nearest].left;
}

template <typename Value>
void RecordCache<Value>::note_use() {
  for (std::size_t i = 0; i < live_.size(); ++i) {
    if (used_[i]) record_[live_[i].record].last_used = frame_;
  }
}

template <typename Value>
std::vector<std::uint32_t> RecordCache<Value>::alive() const {
  std::vector<std::uint32_t> out;
  for (const Live& live : live_) out.push_back(live.record);
  return out;
}

}  // namespace haarlight
