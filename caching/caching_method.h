// Irradiance and radiance caching frame by frame, and temporal radiance caching.

#pragma once

#include <memory>
#include <vector>

#include "caching/animation_method.h"
#include "caching/record_layer.h"

namespace haarlight {

/// Direct light as it is; light after at least one reflection by records of irradiance and, on
/// glossy surfaces, of incoming radiance; light of narrow lobes by rays. Random numbers belong to
/// records, which keep those of the record they replace, and to pixels, not to frames: what does
/// not change does not flicker.
class CachingMethod : public AnimationMethod {
 public:
  /// `scene` must outlive it. Throws Error{invalid_argument} for options out of range.
  CachingMethod(const AnimatedScene& scene, const CachingOptions& options);
  ~CachingMethod() override;

  std::vector<std::string> figures() const override;
  void prepare(int first, int count, const Progress& progress) override;
  double prepare_share() const override;
  FramePicture frame(int number, const Progress& progress) override;

  const RecordCache<RecordValue>& irradiance() const { return irradiance_.cache(); }
  const RecordCache<RadianceValue>& radiance() const { return radiance_.cache(); }

 private:
  struct Update;
  bool two_passes() const;
  void go_to(int number);
  GatherPoints look();
  Update update(const GatherPoints& points, const Progress& progress);
  FramePicture gather(const GatherPoints& points) const;
  RgbD radiance_of(const GatherPoint& point, PathRandom& random, double& left) const;
  void note_use();

  const AnimatedScene& scene_;
  CachingOptions options_;
  RecordLayer<RecordValue> irradiance_;
  RecordLayer<RadianceValue> radiance_;
  LobeHarmonics lobes_;
  std::unique_ptr<CachedFrame> now_;
  std::vector<Update> prepared_;  // by frame, of the first pass
  int prepared_first_ = 0;
};

}  // namespace haarlight
