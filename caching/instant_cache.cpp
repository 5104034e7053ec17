// The instant cache.

#include "caching/instant_cache.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace haarlight {
namespace {

constexpr int kRecordsAtOnce = 4;

}  // namespace

// Of one record's rays; each body of a loop owns one.
struct InstantCache::Counts {
  std::int64_t whole = 0, moving = 0, saved = 0;
  bool updated = false;

  void add_to(InstantCacheReport& report) const {
    report.rays_whole += whole, report.rays_moving += moving, report.rays_saved += saved;
    report.records_updated += updated;
  }
};

InstantCache::InstantCache(const InstantCacheOptions& options)
    : options_(options), fresh_(empty_octree()) {}

// What a light adds to a record, by a ray through everything.
PackedLight InstantCache::look(const MovingVisibility& scene, const Record& record,
                               const VirtualLight& light, Counts& counts, RgbD* whole,
                               RgbD* lost) const {
  const RgbD c = arrival(light, record.position, record.normal, options_.least_distance, lost);
  if (!(l1_norm(c) > 0)) return kUnlit;
  if (whole) *whole += c;
  ++counts.whole;
  const Segment ray = segment_to(light, record.position, record.geometric_normal);
  return scene.occluded(ray) ? kShadowed : pack_light(c);
}

void InstantCache::put(const MovingVisibility& scene, Record& record) const {
  const BodyPlace& p = record.place;
  const auto [a, b, c] = scene.corners(p.triangle);
  record.position = a * (1 - p.b1 - p.b2) + b * p.b1 + c * p.b2;
  const Vec3 across = cross(b - a, c - a);
  const double area = length(across);
  record.geometric_normal = area > 0 ? across * (1 / area) : Vec3{0, 1, 0};
  if (!p.front) record.geometric_normal = -record.geometric_normal;
  record.normal =
      smooth_normal(scene.frame().scene, {p.triangle, p.b1, p.b2, 0}, record.geometric_normal);
}

void InstantCache::sum(std::size_t number) {
  RgbD sum;
  for (const PackedLight p : light_of(number)) {
    if (p & 0xffffffu) sum += unpack_light(p);
  }
  record_[number].irradiance = sum;
}

void InstantCache::drop(std::size_t number) {
  record_[number].alive = indexed_ = false;
  free_.push_back(static_cast<std::uint32_t>(number));
}

bool InstantCache::is_stale(std::size_t record) const {
  if (record_[record].hollow) return true;
  const auto begin = stale_.begin() + static_cast<std::ptrdiff_t>(record * words_);
  return std::any_of(begin, begin + static_cast<std::ptrdiff_t>(words_),
                     [](std::uint64_t bits) { return bits != 0; });
}

void InstantCache::start_anew(const MovingVisibility& scene, std::vector<VirtualLight> lights,
                              InstantCacheReport& report) {
  static_cast<void>(scene);
  ++frame_;
  report.lights_changed = static_cast<std::int64_t>(lights.size());
  report.records_dropped += static_cast<std::int64_t>(alive());
  lights_ = std::move(lights);
  words_ = (lights_.size() + 63) / 64;
  record_.clear(), light_.clear(), stale_.clear(), free_.clear();
  indexed_ = false;
}

void InstantCache::update(const MovingVisibility& scene, std::vector<VirtualLight> lights,
                          InstantCacheReport& report) {
  if (scene.anew() || lights.size() != lights_.size()) {
    start_anew(scene, std::move(lights), report);
    return;
  }
  ++frame_;
  // Cases 1 and 2: lights that are not what, or where, they were.
  changed_.assign(lights.size(), 0);
  any_changed_ = false;
  for (std::size_t k = 0; k < lights.size(); ++k) {
    if (lights[k] == lights_[k]) continue;
    ++report.lights_changed;
    any_changed_ = true;
    changed_[k] = lights[k].same_place(lights_[k]) && lights[k].kind != VirtualLight::Kind::none &&
                          l1_norm(lights_[k].intensity) > 0
                      ? 1
                      : 2;
  }
  lights_ = std::move(lights);
  // Case 5, and records that nobody has asked for.
  for (std::size_t r = 0; r < record_.size(); ++r) {
    const Record& record = record_[r];
    if (!record.alive) continue;
    const bool rides = scene.moved(record.place.triangle);
    if (frame_ - record.used > options_.oldest || (rides && !options_.carry)) {
      drop(r);
      ++report.records_dropped;
    } else if (rides) {
      ++report.records_carried, indexed_ = false;
    }
  }
  std::vector<Counts> counts(record_.size());
  std::vector<char> emptied(record_.size());
  parallel_for(
      static_cast<int>(record_.size()),
      [&](int i) {
        const auto r = static_cast<std::size_t>(i);
        if (!record_[r].alive) return;
        const bool before = record_[r].hollow;
        record_[r].kept += 1;
        if (go_on(scene, r, counts[r])) sum(r);
        emptied[r] = record_[r].hollow != before;
      },
      kRecordsAtOnce);
  for (const Counts& c : counts) c.add_to(report);
  indexed_ = indexed_ && std::ranges::find(emptied, 1) == emptied.end();
}

// Algorithm 1 for one record: cheap tests first. Whether any of its lights has changed.
bool InstantCache::go_on(const MovingVisibility& scene, std::size_t number, Counts& counts) {
  Record& record = record_[number];
  PackedLight* light = light_.data() + number * lights_.size();
  std::uint64_t* stale = stale_.data() + number * words_;
  const bool rides = scene.moved(record.place.triangle);
  if (rides) put(scene, record);
  if (record.hollow) return false;
  // Case 5; or nobody has asked for it lately. Looked at when somebody does.
  const bool unasked = record.used < frame_ - 1 && (scene.any_moved() || any_changed_);
  if (options_.on_demand && (rides || unasked)) {
    record.hollow = true;
    return false;
  }
  if (!scene.any_moved() && !any_changed_) {
    for (std::size_t k = 0; k < lights_.size(); ++k) {
      counts.saved += light[k] != kUnlit && !(stale[k / 64] >> k % 64 & 1u);
    }
    return false;
  }
  bool any = false;
  std::size_t anew = 0;
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    const std::uint64_t bit = std::uint64_t{1} << k % 64;
    if (stale[k / 64] & bit) continue;  // nothing is known that could change
    const VirtualLight& source = lights_[k];
    PackedLight now = light[k];
    if (rides || changed_[k] == 2) {  // cases 1, 2 and 5
      counts.updated = true;
      if (options_.on_demand) {
        stale[k / 64] |= bit;
        continue;
      }
      now = look(scene, record, source, counts);
    } else if (now == kUnlit) {
      continue;  // its place says so, and that has not changed
    } else {
      const Segment ray = segment_to(source, record.position, record.geometric_normal);
      if (!scene.may_meet_moved(ray)) {
        ++counts.saved;
      } else if (++counts.moving; scene.occluded_by_moving(ray)) {  // case 3
        now = kShadowed;
      } else if (now == kShadowed) {  // case 4: what was in between may have gone
        ++counts.moving;
        if (!scene.occluded_by_moving_before(ray)) {
          ++counts.saved;
        } else if (options_.on_demand) {
          counts.updated = true;
          stale[k / 64] |= bit;
          continue;
        } else if (++counts.whole; !scene.occluded_by_rest(ray)) {
          now =
              pack_light(arrival(source, record.position, record.normal, options_.least_distance));
        }
      } else {
        ++counts.saved;
      }
      // Another intensity at the same place: visibility stays as it was found.
      if (changed_[k] == 1 && now != kShadowed) {
        now = pack_light(arrival(source, record.position, record.normal, options_.least_distance));
      }
    }
    if (now == light[k]) continue;
    light[k] = now;
    any = counts.updated = true;
    ++anew;
  }
  look_at(record, anew);
  return any;
}

// So many of its lights are not what they were.
void InstantCache::look_at(Record& record, std::size_t anew) const {
  record.kept *= 1 - static_cast<float>(anew) / static_cast<float>(lights_.size());
}

void InstantCache::refresh(const MovingVisibility& scene, std::size_t number, Counts& counts) {
  std::uint64_t* stale = stale_.data() + number * words_;
  PackedLight* light = light_.data() + number * lights_.size();
  Record& record = record_[number];
  bool any = record.hollow;
  std::size_t anew = 0;
  for (std::size_t k = 0; k < lights_.size(); ++k) {
    if (!record.hollow && !(stale[k / 64] >> k % 64 & 1u)) continue;
    light[k] = look(scene, record, lights_[k], counts);
    any = true, ++anew;
  }
  std::fill(stale, stale + words_, 0);
  record.hollow = false;
  look_at(record, anew);
  if (any) sum(number);
}

void InstantCache::refresh(const MovingVisibility& scene, std::span<const std::uint32_t> numbers,
                           InstantCacheReport& report) {
  std::vector<Counts> counts(numbers.size());
  parallel_for(
      static_cast<int>(numbers.size()),
      [&](int i) {
        refresh(scene, numbers[static_cast<std::size_t>(i)], counts[static_cast<std::size_t>(i)]);
      },
      kRecordsAtOnce);
  for (const Counts& c : counts) c.add_to(report);
}

void InstantCache::refresh_all(const MovingVisibility& scene, InstantCacheReport& report) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t r = 0; r < record_.size(); ++r) {
    if (record_[r].alive) all.push_back(r);
  }
  refresh(scene, all, report);
  indexed_ = false;
}

std::uint32_t InstantCache::new_number(const BodyPlace& place, const MovingVisibility& scene) {
  std::uint32_t number = 0;
  if (free_.empty()) {
    number = static_cast<std::uint32_t>(record_.size());
    record_.emplace_back();
    light_.resize(light_.size() + lights_.size());
    stale_.resize(stale_.size() + words_);
  } else {
    number = free_.back();
    free_.pop_back();
  }
  Record& record = record_[number];
  record = {};
  record.place = place, record.alive = true, record.used = frame_;
  put(scene, record);
  indexed_ = false;
  return number;
}

// Traces all rays of new records.
void InstantCache::make(const MovingVisibility& scene, std::span<const std::uint32_t> numbers,
                        InstantCacheReport& report) {
  std::vector<Counts> counts(numbers.size());
  parallel_for(
      static_cast<int>(numbers.size()),
      [&](int i) {
        const std::size_t r = numbers[static_cast<std::size_t>(i)];
        Record& record = record_[r];
        RgbD whole, lost;
        for (std::size_t k = 0; k < lights_.size(); ++k) {
          light_[r * lights_.size() + k] =
              look(scene, record, lights_[k], counts[static_cast<std::size_t>(i)], &whole, &lost);
        }
        const double all = luminance(whole) + luminance(lost);
        record.lost = all > 0 ? luminance(lost) / all : 0;
        std::fill_n(stale_.begin() + static_cast<std::ptrdiff_t>(r * words_), words_, 0);
        sum(r);
      },
      kRecordsAtOnce);
  for (const Counts& c : counts) c.add_to(report);
  report.records_new += static_cast<std::int64_t>(numbers.size());
}

std::size_t InstantCache::add(const MovingVisibility& scene, const BodyPlace& place,
                              InstantCacheReport& report) {
  const std::uint32_t number = new_number(place, scene);
  make(scene, {&number, 1}, report);
  return number;
}

std::vector<PackedLight> InstantCache::from_scratch(const MovingVisibility& scene,
                                                    const BodyPlace& place) const {
  Record record;
  record.place = place;
  put(scene, record);
  Counts counts;
  std::vector<PackedLight> out;
  for (const VirtualLight& light : lights_) out.push_back(look(scene, record, light, counts));
  return out;
}

}  // namespace haarlight
