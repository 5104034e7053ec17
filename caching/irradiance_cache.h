// Records of irradiance, those of one frame at hand: look up, mark, add.

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "caching/irradiance_record.h"
#include "caching/record_octree.h"
#include "precompute/scene.h"

namespace haarlight {

/// A record and the frames it is good for: born, born + 1, ... born + life - 1.
struct CacheRecord {
  BodyPlace place;
  std::uint64_t key = 0;  ///< of its random numbers; its successors have the same
  int born = 0, life = 1;
  double radius = 0;   ///< metres
  RecordValue value;   ///< in frame `born`
  RecordValue change;  ///< a frame (equations 13 to 20)
  int last_used = -1;  ///< the last frame whose picture it had a part in
};

/// All records of an animation. Looking up is safe from any number of threads, adding is not.
class IrradianceCache {
 public:
  /// `accuracy`: a of equation 3 as Ward has it, the largest error, in (0, 1].
  explicit IrradianceCache(double accuracy) : accuracy_(accuracy) {}

  /// Goes to a frame: records that are good for it move to where their bodies are now.
  void begin(int frame, const Scene& scene);
  /// Forgets all records.
  void clear();

  /// Adds a record that is good for the frame at hand, and keeps it and its neighbours from
  /// reaching farther than the other reaches, plus the distance between them (neighbour clamping,
  /// Krivanek and others 2006), but none below `least` metres. Returns its number.
  std::uint32_t add(const CacheRecord& record, double least);

  /// Whether any record counts at a place of unit `normal` (world).
  bool covers(const Vec3& position, const Vec3& normal) const;

  struct Found {
    RgbD irradiance;  ///< W/m^2
    double left = 0;  ///< frames that the records are still good for, weighted mean, >= 1
  };
  /// The mean of all records that count (equation 1). Where there is none, the record of the least
  /// error; nothing if no record has a finite one. What it uses is marked.
  std::optional<Found> at(const Vec3& position, const Vec3& normal, const Vec3& shading) const;
  /// Writes down which records were used in this frame since begin().
  void note_use();

  const std::vector<CacheRecord>& records() const { return record_; }
  CacheRecord& record(std::uint32_t number) { return record_[number]; }
  /// Numbers of the records that are good for the frame at hand.
  std::vector<std::uint32_t> alive() const;
  std::size_t alive_count() const { return live_.size(); }

 private:
  struct Live {
    std::uint32_t record;
    PlaceFrame at;
    RecordValue value;
    double radius, left;
  };
  void add_live(std::uint32_t number, const Scene& scene);
  void mark(std::size_t live) const;

  double accuracy_;
  std::vector<CacheRecord> record_;
  int frame_ = 0;
  const Scene* scene_ = nullptr;
  std::vector<Live> live_;
  mutable std::vector<std::uint8_t> used_;  // by live number; written through atomic_ref
  RecordOctree octree_{{}, 1};
};

}  // namespace haarlight
