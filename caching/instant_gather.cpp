// The instant cache: interpolation, and where new records come to lie.

#include <algorithm>
#include <atomic>
#include <cmath>

#include "caching/instant_cache.h"
#include "caching/patch_sum.h"
#include "core/parallel.h"

namespace haarlight {

RecordIndex::Entry InstantCache::entry(std::uint32_t number) const {
  const Record& record = record_[number];
  return {surface_coordinates(record.position, record.normal, 1 / options_.unit), number};
}

// Whether a record that this picture has made is within the spacing of a point.
bool InstantCache::covered(const SurfacePoint& point) const {
  const auto px = static_cast<float>(point.position.x), py = static_cast<float>(point.position.y),
             pz = static_cast<float>(point.position.z);
  const auto nx = static_cast<float>(point.normal.x), ny = static_cast<float>(point.normal.y),
             nz = static_cast<float>(point.normal.z);
  const auto r = static_cast<float>(options_.spacing * options_.radius);
  const auto per_unit = static_cast<float>(1 / options_.unit);
  const float reach = r / per_unit, farthest = reach * reach, most_turn = r * r;
  for (const NearbyOctree::Entry& e : fresh_.near(point.position)) {
    const float x = e.position[0] - px, y = e.position[1] - py, z = e.position[2] - pz;
    const float square = x * x + y * y + z * z;
    const float turn = 1 - (e.normal[0] * nx + e.normal[1] * ny + e.normal[2] * nz);
    if (!(square < farthest) || !(turn < most_turn)) continue;
    if (std::sqrt(square) * per_unit + std::sqrt(std::max(turn, 0.0f)) < r) return true;
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

// New records for grids of pixels from coarse to fine; each grid asks for those of its pixels that
// no older record and no coarser grid has covered.
std::vector<std::uint32_t> InstantCache::cover(const MovingVisibility& scene,
                                               std::span<const SurfaceRow> rows) {
  constexpr std::size_t kCoarse = 16;
  fresh_ = empty_octree();
  std::vector<std::uint32_t> made;
  std::vector<std::vector<const SurfacePoint*>> wanting(rows.size());
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
          if (!sum_[y][i].near && !covered(row.point[i])) list.push_back(&row.point[i]);
        }
      }
    });
    for (std::size_t y = 0; y < rows.size(); y += step) {
      for (const SurfacePoint* p : wanting[y]) {
        if (covered(*p)) continue;
        made.push_back(new_number(p->place, scene));
        const Record& record = record_[made.back()];
        fresh_.insert(made.back(), record.position, record.normal);
      }
    }
  }
  return made;
}

void InstantCache::gather(const MovingVisibility& scene, std::span<const SurfaceRow> rows,
                          std::vector<std::vector<RgbD>>& irradiance_of,
                          InstantCacheReport& report) {
  sum_.resize(rows.size());
  for (std::size_t y = 0; y < rows.size(); ++y) sum_[y].assign(rows[y].point.size(), {});
  const double per_unit = 1 / options_.unit;
  const RecordReach reach{static_cast<float>(options_.radius),
                          static_cast<float>(options_.spacing * options_.radius),
                          options_.fade ? static_cast<float>(1 / options_.radius) : 0.0f};
  const auto index_of = [&](const std::vector<std::uint32_t>& numbers) {
    std::vector<RecordIndex::Entry> entries;
    for (const std::uint32_t r : numbers) entries.push_back(entry(r));
    return entries;
  };
  if (!indexed_) {
    std::vector<std::uint32_t> alive;
    for (std::uint32_t r = 0; r < record_.size(); ++r) {
      if (record_[r].alive) alive.push_back(r);
    }
    index_.build(index_of(alive));
    indexed_ = true;
  }
  // First the records that are up to date; those with rays that wait are only asked for.
  std::vector<char> waits(record_.size());
  for (std::uint32_t r = 0; r < record_.size(); ++r) waits[r] = record_[r].alive && is_stale(r);
  const auto share = [&](std::uint32_t r) {
    return RecordShare{Rgb(record_[r].irradiance), r >= waits.size() || !waits[r]};
  };
  const auto mark = [&](std::uint32_t r) { use(r); };
  index_.set_light(share);
  add_patches(index_, rows, per_unit, reach, mark, sum_);
  // Then those that are made, or whose rays are traced, because somebody asks.
  std::vector<std::uint32_t> late;
  for (std::uint32_t r = 0; r < waits.size(); ++r) {
    if (waits[r] && record_[r].used == frame_) late.push_back(r);
  }
  refresh(scene, late, report);
  const std::vector<std::uint32_t> made = cover(scene, rows);
  make(scene, made, report);
  late.insert(late.end(), made.begin(), made.end());
  waits.clear();
  RecordIndex late_index;
  late_index.build(index_of(late));
  late_index.set_light(share);
  add_patches(late_index, rows, per_unit, reach, mark, sum_);

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
