// The instant cache: irradiance from virtual lights, kept in space and time.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "caching/body_place.h"
#include "caching/moving_visibility.h"
#include "caching/nearby_octree.h"
#include "caching/packed_light.h"
#include "caching/record_blocks.h"
#include "caching/record_index.h"
#include "caching/surface_points.h"
#include "caching/virtual_lights.h"

namespace haarlight {

struct InstantCacheOptions {
  double radius = 0.25;  ///< a of equation 4: a record is used where its weight is above 1/a
  double unit = 1;       ///< local units that count as 1 in equation 5's distance
  double spacing = 0.6;  ///< a new record where none has a weight above 1/(spacing * a), (0, 1]
  bool fade = true;      ///< weights less 1/a, so that records do not end in a step
  double least_distance = 0.1;  ///< min_d of equation 2, local units
  int oldest = 60;              ///< frames without use after which a record is dropped, >= 0
  bool carry = false;           ///< records on bodies that move go with them; else are dropped
  bool on_demand = true;        ///< rays are traced anew when their record is used; else at once
};

/// What one frame did to a cache. A plain value.
struct InstantCacheReport {
  std::int64_t lights_changed = 0;  ///< virtual lights that are not what they were
  std::int64_t records_new = 0, records_dropped = 0, records_carried = 0;
  std::int64_t records_updated = 0;  ///< old ones with a ray or a light that was looked at anew
  std::int64_t rays_whole = 0;       ///< shadow rays through the whole scene (or all that rests)
  std::int64_t rays_moving = 0;      ///< through what moves, or where that was, alone
  std::int64_t rays_saved = 0;       ///< visibility known from the frame before, without either
};

/// Records of irradiance on the surfaces of a scene that moves, each with what every virtual light
/// adds to it (Debattista and others 2009, sections 3.1 and 3.2). After update() and gather() each
/// record that was used, and unless `on_demand` every one, holds bit by bit what a record made from
/// scratch at its place would. The same bits on any number of threads; not safe to use from two at
/// once.
class InstantCache {
 public:
  explicit InstantCache(const InstantCacheOptions& options);

  /// Goes on to the current frame of `scene` under `lights`: Algorithm 1. Records keep what is
  /// still true of them; `lights` of another count, or a scene that is new, drop them all.
  void update(const MovingVisibility& scene, std::vector<VirtualLight> lights,
              InstantCacheReport& report);
  /// The same without memory: no record outlives it.
  void start_anew(const MovingVisibility& scene, std::vector<VirtualLight> lights,
                  InstantCacheReport& report);

  /// Whether nothing that records hold has changed in the current frame of `scene` under `lights`.
  bool is_of(const MovingVisibility& scene, const std::vector<VirtualLight>& lights) const {
    return !scene.anew() && !scene.any_moved() && lights == lights_;
  }

  /// Irradiance of each point by interpolation, equation 4, in the order of `rows`; makes records
  /// where points have none near and brings those up to date that they use. An order of the points
  /// themselves decides where records come to lie: coarse grid first.
  void gather(const MovingVisibility& scene, std::span<const SurfaceRow> rows,
              std::vector<std::vector<RgbD>>& irradiance, InstantCacheReport& report);

  /// After gather(): Record::kept of the records that light each point, the mean by their weights,
  /// at most `most`; -1 where there are none. In the order of `rows`.
  void kept_for(std::span<const SurfaceRow> rows, int most,
                std::vector<std::vector<float>>& frames) const;

  /// A record as it stands. Those that are not alive are places for new ones.
  struct Record {
    BodyPlace place;
    Vec3 position, geometric_normal, normal;  ///< local, now
    RgbD irradiance;                          ///< W/m^2; sum of its lights
    double lost = 0;  ///< share of the light that the bound of equation 2 took, when it was made
    int used = 0;     ///< frame in which it was last used
    float kept = 0;   ///< for how many frames its lights have been as they are, their mean
    bool alive = false;
    bool hollow = false;  ///< all its rays wait: a place where a record may be
  };
  std::span<const Record> records() const { return record_; }
  std::size_t alive() const { return record_.size() - free_.size(); }
  std::span<const PackedLight> light_of(std::size_t record) const {
    return {light_.data() + record * lights_.size(), lights_.size()};
  }
  /// Whether rays of a record wait to be asked for.
  bool is_stale(std::size_t record) const;
  /// What a record at this place would hold if it were made now.
  std::vector<PackedLight> from_scratch(const MovingVisibility& scene,
                                        const BodyPlace& place) const;
  /// A record at a place without asking points: for tests and tools. Its number.
  std::size_t add(const MovingVisibility& scene, const BodyPlace& place,
                  InstantCacheReport& report);
  /// Brings every record up to date, used or not.
  void refresh_all(const MovingVisibility& scene, InstantCacheReport& report);

 private:
  struct Counts;
  PackedLight look(const MovingVisibility& scene, const Record& record, const VirtualLight& light,
                   Counts& counts, RgbD* whole = nullptr, RgbD* lost = nullptr) const;
  void put(const MovingVisibility& scene, Record& record) const;
  void make(const MovingVisibility& scene, std::span<const std::uint32_t> numbers,
            InstantCacheReport& report);
  bool go_on(const MovingVisibility& scene, std::size_t number, Counts& counts);
  void refresh(const MovingVisibility& scene, std::size_t number, Counts& counts);
  void refresh(const MovingVisibility& scene, std::span<const std::uint32_t> numbers,
               InstantCacheReport& report);
  void look_at(Record& record, std::size_t anew) const;
  void sum(std::size_t number);
  std::uint32_t new_number(const BodyPlace& place, const MovingVisibility& scene);
  void drop(std::size_t number);
  RecordIndex::Entry entry(std::uint32_t number) const;
  bool covered(const Vec3& position, const Vec3& normal) const;
  std::uint32_t hollow_near(const NearbyOctree& hollow, const SurfacePoint& point) const;
  struct Cover {
    std::vector<std::uint32_t> made, kept;
  };
  Cover cover(const MovingVisibility& scene, std::span<const SurfaceRow> rows);
  void drop_surplus(InstantCacheReport& report);
  void use(std::uint32_t number);
  RecordReach reach() const;
  NearbyOctree empty_octree() const { return {2, options_.radius * options_.unit}; }

  InstantCacheOptions options_;
  std::vector<VirtualLight> lights_;
  bool any_changed_ = false;
  std::vector<char> changed_;         // by light: 0 not, 1 its intensity, 2 its place
  std::vector<Record> record_;        // by number
  std::vector<PackedLight> light_;    // lights_.size() a record
  std::vector<std::uint64_t> stale_;  // a bit a light, words_ a record
  std::vector<std::uint32_t> free_;   // numbers that are not alive, those to take first last
  std::size_t words_ = 0;
  int frame_ = 0;      // counts updates
  RecordIndex index_;  // of all that are alive and not hollow, where indexed_
  bool indexed_ = false;
  NearbyOctree fresh_;                       // those that this picture has made or kept
  std::vector<std::vector<RecordSum>> sum_;  // by row and point of this picture
};

}  // namespace haarlight
