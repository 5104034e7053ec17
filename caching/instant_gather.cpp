// The instant cache: interpolation, and where new records come to lie.

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "caching/instant_cache.h"
#include "caching/patch_sum.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

constexpr double kHollowNear = 0.5;  // of the spacing
constexpr std::uint32_t kNoRecord = std::numeric_limits<std::uint32_t>::max();

// 1 / w_k between a place and records: equation 5 in single precision.
class RecordDistance {
 public:
  RecordDistance(const Vec3& position, const Vec3& normal, double unit)
      : position_(floats(position)),
        normal_(floats(normal)),
        per_unit_(static_cast<float>(1 / unit)) {}
  // Whether it is less than `most`; most becomes it.
  bool below(const NearbyOctree::Entry& e, float& most) const {
    const float x = e.position[0] - position_[0], y = e.position[1] - position_[1],
                z = e.position[2] - position_[2];
    const float way = std::sqrt(x * x + y * y + z * z) * per_unit_;
    if (!(way < most)) return false;
    const float turn =
        1 - (e.normal[0] * normal_[0] + e.normal[1] * normal_[1] + e.normal[2] * normal_[2]);
    const float all = way + std::sqrt(std::max(turn, 0.0f));
    if (!(all < most)) return false;
    most = all;
    return true;
  }

 private:
  static std::array<float, 3> floats(const Vec3& v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  }
  std::array<float, 3> position_, normal_;
  float per_unit_;
};

}  // namespace

RecordIndex::Entry InstantCache::entry(std::uint32_t number) const {
  const Record& record = record_[number];
  return {surface_coordinates(record.position, record.normal, 1 / options_.unit), number};
}

// Whether a record that this picture has made or kept is within the spacing of a place.
bool InstantCache::covered(const Vec3& position, const Vec3& normal) const {
  const RecordDistance distance(position, normal, options_.unit);
  auto spacing = static_cast<float>(options_.spacing * options_.radius);
  for (const NearbyOctree::Entry& e : fresh_.near(position)) {
    if (distance.below(e, spacing)) return true;
  }
  return false;
}

// All threads that write write the same.
void InstantCache::use(std::uint32_t number) {
  std::atomic_ref used(record_[number].used);
  if (used.load(std::memory_order_relaxed) != frame_) {
    used.store(frame_, std::memory_order_relaxed);
  }
}

// The nearest hollow record that is good in place of a new one here. A record that goes with its
// body saves no ray: more of them than there would be new ones cost more than those.
std::uint32_t InstantCache::hollow_near(const NearbyOctree& hollow,
                                        const SurfacePoint& point) const {
  const RecordDistance distance(point.position, point.normal, options_.unit);
  auto nearest = static_cast<float>(kHollowNear * options_.spacing * options_.radius);
  std::uint32_t found = kNoRecord;
  for (const NearbyOctree::Entry& e : hollow.near(point.position)) {
    if (distance.below(e, nearest)) found = e.number;
  }
  return found;
}

// Records for grids of pixels from coarse to fine; each grid asks for those of its pixels that no
// other record and no coarser grid has covered. Hollow ones are filled, or new ones made.
InstantCache::Cover InstantCache::cover(const MovingVisibility& scene,
                                        std::span<const SurfaceRow> rows) {
  constexpr std::size_t kCoarse = 16;
  NearbyOctree hollow(2, kHollowNear * options_.spacing * options_.radius * options_.unit);
  for (std::uint32_t r = 0; r < record_.size(); ++r) {
    const Record& record = record_[r];
    if (record.alive && record.hollow) hollow.insert(r, record.position, record.normal);
  }
  struct Wanting {
    const SurfacePoint* point;
    std::uint32_t hollow;
  };
  Cover out;
  std::vector<std::vector<Wanting>> wanting(rows.size());
  for (std::size_t step = kCoarse; step >= 1; step /= 2) {
    const int lines = static_cast<int>((rows.size() + step - 1) / step);
    parallel_for(lines, [&](int line) {
      const std::size_t y = static_cast<std::size_t>(line) * step;
      auto& list = wanting[y];
      list.clear();
      const SurfaceRow& row = rows[y];
      for (std::size_t x = 0; x + 1 < row.first.size(); x += step) {
        if (step < kCoarse && y % (2 * step) == 0 && x % (2 * step) == 0) continue;
        for (std::size_t i = row.first[x]; i < row.first[x + 1]; ++i) {
          const SurfacePoint& p = row.point[i];
          if (sum_[y][i].near || covered(p.position, p.normal)) continue;
          list.push_back({&p, hollow_near(hollow, p)});
        }
      }
    });
    for (std::size_t y = 0; y < rows.size(); y += step) {
      for (const Wanting& w : wanting[y]) {
        // Who has got its hollow record covers it.
        if (covered(w.point->position, w.point->normal)) continue;
        const bool keep = w.hollow != kNoRecord;
        const std::uint32_t number = keep ? w.hollow : new_number(w.point->place, scene);
        record_[number].hollow = false;
        (keep ? out.kept : out.made).push_back(number);
        fresh_.insert(number, record_[number].position, record_[number].normal);
      }
    }
  }
  return out;
}

// Hollow records that are no longer where one could be wanted.
void InstantCache::drop_surplus(InstantCacheReport& report) {
  for (std::size_t r = 0; r < record_.size(); ++r) {
    const Record& record = record_[r];
    if (!record.alive || !record.hollow || !covered(record.position, record.normal)) continue;
    drop(r);
    ++report.records_dropped;
  }
}

RecordReach InstantCache::reach() const {
  return {static_cast<float>(options_.radius),
          static_cast<float>(options_.spacing * options_.radius),
          options_.fade ? static_cast<float>(1 / options_.radius) : 0.0f};
}

void InstantCache::kept_for(std::span<const SurfaceRow> rows, int most,
                            std::vector<std::vector<float>>& frames) const {
  std::vector<RecordIndex::Entry> entries;
  for (std::uint32_t r = 0; r < record_.size(); ++r) {
    if (record_[r].alive && !record_[r].hollow) entries.push_back(entry(r));
  }
  RecordIndex index;
  index.build(std::move(entries));
  index.set_light([&](std::uint32_t r) {
    const float kept = std::min(record_[r].kept, static_cast<float>(most));
    return Rgb{kept, kept, kept};
  });
  std::vector<std::vector<RecordSum>> sum(rows.size());
  for (std::size_t y = 0; y < rows.size(); ++y) sum[y].resize(rows[y].point.size());
  add_patches(
      index, rows, 1 / options_.unit, reach(), [](std::uint32_t) {}, sum);
  frames.resize(rows.size());
  for (std::size_t y = 0; y < rows.size(); ++y) {
    frames[y].clear();
    for (const RecordSum& s : sum[y]) frames[y].push_back(s.weight > 0 ? s.r / s.weight : -1);
  }
}

void InstantCache::gather(const MovingVisibility& scene, std::span<const SurfaceRow> rows,
                          std::vector<std::vector<RgbD>>& irradiance_of,
                          InstantCacheReport& report) {
  sum_.resize(rows.size());
  for (std::size_t y = 0; y < rows.size(); ++y) sum_[y].assign(rows[y].point.size(), {});
  const double per_unit = 1 / options_.unit;
  const auto add = [&](const RecordIndex& index) {
    add_patches(
        index, rows, per_unit, reach(), [&](std::uint32_t r) { use(r); }, sum_);
  };
  const auto light = [&](std::uint32_t r) { return Rgb(record_[r].irradiance); };
  const auto index_of = [&](const std::vector<std::uint32_t>& numbers) {
    std::vector<RecordIndex::Entry> entries;
    for (const std::uint32_t r : numbers) entries.push_back(entry(r));
    RecordIndex index;
    index.build(std::move(entries));
    index.set_light(light);
    return index;
  };
  // Those that somebody asked for in the last frame, and that update() has left rays to.
  std::vector<std::uint32_t> solid, waiting;
  std::size_t hollow = 0;
  for (std::uint32_t r = 0; r < record_.size(); ++r) {
    if (!record_[r].alive) continue;
    hollow += record_[r].hollow;
    if (record_[r].hollow) continue;
    solid.push_back(r);
    if (is_stale(r)) waiting.push_back(r);
  }
  refresh(scene, waiting, report);
  fresh_ = empty_octree();
  // Few records beside those that are to come: summed with them, all in one go.
  const bool few = solid.size() < hollow;
  if (few) {
    for (const std::uint32_t r : solid) fresh_.insert(r, record_[r].position, record_[r].normal);
    indexed_ = false;
  } else {
    if (indexed_) {
      index_.set_light(light);
    } else {
      index_ = index_of(solid);
    }
    indexed_ = true;
    add(index_);
    solid.clear();
  }
  const Cover found = cover(scene, rows);
  for (const std::uint32_t r : found.kept) {
    std::fill_n(stale_.begin() + static_cast<std::ptrdiff_t>(r * words_), words_,
                ~std::uint64_t{0});
  }
  report.records_updated += static_cast<std::int64_t>(found.kept.size());
  refresh(scene, found.kept, report);
  make(scene, found.made, report);
  drop_surplus(report);
  indexed_ = indexed_ && found.kept.empty();
  for (const auto* numbers : {&found.kept, &found.made}) {
    solid.insert(solid.end(), numbers->begin(), numbers->end());
  }
  add(index_of(solid));

  irradiance_of.resize(rows.size());
  parallel_for(static_cast<int>(rows.size()), [&](int line) {
    const auto y = static_cast<std::size_t>(line);
    irradiance_of[y].resize(rows[y].point.size());
    for (std::size_t i = 0; i < rows[y].point.size(); ++i) {
      const RecordSum& s = sum_[y][i];
      irradiance_of[y][i] =
          s.weight > 0 ? RgbD(Rgb(s.r, s.g, s.b)) * (1 / static_cast<double>(s.weight)) : RgbD{};
    }
  });
}

}  // namespace haarlight
