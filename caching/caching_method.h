// Irradiance caching frame by frame, and temporal radiance caching.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "caching/animation_method.h"
#include "caching/gather_points.h"
#include "caching/irradiance_cache.h"
#include "caching/reprojection.h"
#include "caching/temporal_weight.h"

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
  int glossy_samples = 8;         ///< of a lobe, a pixel
  bool temporal = false;          ///< else a new cache every frame
  TemporalAccuracy age;           ///< of records, if temporal
  TemporalGradients gradients = TemporalGradients::interpolated;
  bool show_life = false;  ///< an extra picture: frames that records are still good for
  int check = 0;  ///< so many records a frame are sampled anew, to tell how far they are off
  std::uint64_t seed = 1;
};

/// Direct light as it is, light after at least one reflection by records of irradiance, light of
/// narrow lobes by rays. Random numbers belong to records, which keep those of the record they
/// replace, and to pixels, not to frames: what does not change does not flicker.
class CachingMethod : public AnimationMethod {
 public:
  /// `scene` must outlive it.
  CachingMethod(const AnimatedScene& scene, const CachingOptions& options);
  ~CachingMethod() override;

  std::vector<std::string> figures() const override;
  void prepare(int first, int count, const Progress& progress) override;
  double prepare_share() const override;
  FramePicture frame(int number, const Progress& progress) override;

  const IrradianceCache& cache() const { return cache_; }

 private:
  struct Frame;
  struct Report;
  struct Request;
  bool two_passes() const;
  void go_to(int number);
  Report update(const GatherPoints& points, const Progress& progress);
  void make(const std::vector<Request>& requests, Report& report);
  void replace_old(Report& report);
  void close_last(Report& report);
  void fill(const GatherPoints& points, Report& report, const Progress& progress);
  void check_records(Report& report) const;
  FramePicture gather(const GatherPoints& points) const;
  double pixel_metres(const Vec3& position) const;

  const AnimatedScene& scene_;
  CachingOptions options_;
  IrradianceCache cache_;
  std::unique_ptr<Frame> now_;
  std::vector<Report> prepared_;  // by frame, of the first pass
  int prepared_first_ = 0;
};

}  // namespace haarlight
