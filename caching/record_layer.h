// All records of one kind: which are made, when and where, frame by frame.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "caching/gather_points.h"
#include "caching/radiance_record.h"
#include "caching/record_cache.h"
#include "caching/reprojection.h"
#include "caching/temporal_weight.h"
#include "core/progress.h"

namespace haarlight {

/// How records change while they are used: Gautron and others 2007, section 4.5.
enum class TemporalGradients {
  none,
  extrapolated,  ///< towards the next frame as reprojection has it (equations 15 to 17)
  interpolated   ///< towards the record that replaces them (18 to 20): two passes
};

struct CachingOptions {
  int width = 512, height = 512;  ///< pixels
  double accuracy = 0.2;          ///< a: largest error of using a record (Ward's), (0, 1]
  double least_spacing = 3;       ///< pixels: a record reaches at least so far
  double most_spacing = 40;       ///< pixels: and at most so far
  int hemisphere_samples = 400;   ///< directions of a record
  int direct_samples = 4;         ///< on shining triangles, a pixel
  int glossy_samples = 8;         ///< of a narrow lobe, a pixel
  bool temporal = false;          ///< else a new cache every frame
  TemporalAccuracy age;           ///< of records, if temporal
  TemporalGradients gradients = TemporalGradients::interpolated;
  bool show_life = false;  ///< an extra picture: frames that records are still good for
  int check = 0;  ///< so many records a frame are sampled anew, to tell how far they are off
  std::uint64_t seed = 1;
};

/// A frame, the one after it, and rays in the first.
struct CachedFrame {
  int number = 0;
  std::unique_ptr<AnimatedFrame> now, next;  ///< next, change: if records are temporal
  std::unique_ptr<FrameTracer> tracer;
  std::unique_ptr<FrameChange> change;
  const LobeHarmonics* lobes = nullptr;  ///< tables of all lobes of this frame
  Camera camera;
  double build_ms = 0;
};

/// What an update did.
struct RecordReport {
  int made = 0, replaced = 0;
  std::size_t alive = 0;
  double rays = 0;                             ///< of hemispheres, without what they lead to
  double hemisphere_ms = 0, reproject_ms = 0;  ///< summed over threads
  // Of records that were sampled anew: sums, and of how many.
  double off = 0, reprojection_error = 0, still_error = 0;
  std::size_t checked = 0;
};

/// Records of irradiance (RecordValue) or of incoming radiance (RadianceValue).
template <typename Value>
class RecordLayer {
 public:
  explicit RecordLayer(const CachingOptions& options)
      : options_(options), cache_(options.accuracy) {}

  /// Goes to a frame: lets records that are still good move with their bodies.
  void begin(const CachedFrame& frame);
  /// Makes what the points of a picture need: those records whose life is over are replaced, if
  /// they had a part in the last picture, then new ones are made where none counts. Always so many
  /// at once, so that records do not depend on the number of threads. Throws Error{cancelled}.
  void update(const CachedFrame& frame, const GatherPoints& points, RecordReport& report,
              const Progress& progress);
  /// After the last frame: records in use that outlive it are sampled once more, for interpolation.
  void close(const CachedFrame& frame, RecordReport& report);
  /// How far records of several ages are from what would be sampled now, and reprojections of what
  /// they see now, and what they see now, from what is sampled in the next frame.
  void check(const CachedFrame& frame, const FrameTracer& next, RecordReport& report) const;

  const RecordCache<Value>& cache() const { return cache_; }
  RecordCache<Value>& cache() { return cache_; }

 private:
  struct Request {
    BodyPlace place;
    std::uint64_t key;
    std::optional<std::uint32_t> replaces;
    std::int32_t lobe = 0;
    Vec3 to_viewer;
  };
  static bool wants(const GatherPoint& point);
  void make(const CachedFrame& frame, const std::vector<Request>& requests, RecordReport& report);

  CachingOptions options_;
  RecordCache<Value> cache_;
};

extern template class RecordLayer<RecordValue>;
extern template class RecordLayer<RadianceValue>;

}  // namespace haarlight
