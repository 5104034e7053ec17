// A few tiles traced before the rest, to learn how much may be dropped.

#include "precompute/pilots.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/parallel.h"

namespace haarlight {

std::vector<int> tiles_with_scene(TileSource::Worker& worker,
                                  std::span<const std::uint32_t> order) {
  std::vector<int> seen;
  const int tiles = static_cast<int>(order.size() / kTileRows);
  for (int t = 0; t < tiles; ++t) {
    if (worker.shows_scene(order.subspan(static_cast<std::size_t>(t) * kTileRows, kTileRows))) {
      seen.push_back(t);
    }
  }
  return seen;
}

std::vector<int> choose_pilots(TileSource::Worker& worker, std::span<const std::uint32_t> order,
                               int& seen_count) {
  const std::vector<int> seen = tiles_with_scene(worker, order);
  seen_count = static_cast<int>(seen.size());
  const std::size_t count = std::min<std::size_t>(kPilotTiles, seen.size());
  std::vector<int> pilots;
  for (std::size_t i = 0; i < count; ++i) {
    pilots.push_back(seen[(2 * i + 1) * seen.size() / (2 * count)]);
  }
  return pilots;
}

RayCounts trace_pilots(const TileSource& source, std::span<const std::uint32_t> order,
                       std::span<const int> pilots, int threads, ToleranceTuner& tuner,
                       const std::function<void(int count)>& done) {
  struct Work {
    std::unique_ptr<TileSource::Worker> worker;
    TileRows rows;
    ToleranceTuner::Pilot pilot;
  };
  std::vector<Work> work(std::min(pilots.size(), static_cast<std::size_t>(std::max(1, threads))));
  for (Work& w : work) w.worker = source.make_worker();
  for (std::size_t begin = 0; begin < pilots.size(); begin += work.size()) {
    const std::size_t count = std::min(work.size(), pilots.size() - begin);
    parallel_for(static_cast<int>(count), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      const auto tile = static_cast<std::size_t>(pilots[begin + at]);
      work[at].worker->trace(order.subspan(tile * kTileRows, kTileRows), work[at].rows);
      work[at].pilot = tuner.measure(work[at].rows);
    });
    for (std::size_t i = 0; i < count; ++i) tuner.add(std::move(work[i].pilot));
    done(static_cast<int>(count));
  }
  RayCounts counts;
  for (const Work& w : work) counts += w.worker->counts;
  return counts;
}

}  // namespace haarlight
