// Relights a fixed view (Overbeck 2006, section 6.1): a row of T is a pixel.

#pragma once

#include <cstdint>
#include <span>

#include "core/image.h"
#include "prt/relight_stats.h"
#include "prt/row_sums.h"
#include "prt/scene_view.h"
#include "wavelet/environment.h"

namespace haarlight {

/// picture() == T * shown after every apply(): the radiance of the scene, nothing where it is not.
class ImageRelighter {
 public:
  /// Throws Error{invalid_argument} for the transport of a mesh.
  explicit ImageRelighter(Transport transport);

  /// See RowSums::apply for parts.
  RelightStats apply(const LightingUpdate& update, UpdatePart part = UpdatePart::whole);
  /// See RowSums::expect_resets.
  void expect_resets(bool expected) { sums_.expect_resets(expected); }
  void keep_logs_short(bool keep) { sums_.keep_logs_short(keep); }
  const RowSums& sums() const { return sums_; }
  const Image& picture() const { return picture_; }
  const Transport& transport() const { return sums_.transport(); }
  std::uint64_t extra_bytes() const { return sums_.extra_bytes(); }

 private:
  RowSums sums_;
  Image picture_;
};

/// T * lighting in one call, for a picture that is needed once. `lighting` is layout.size()
/// coefficients. Agrees with ImageRelighter to rounding; a test says so.
Image relight_once(const Transport& transport, std::span<const Rgb> lighting);

/// Draws `environment`, turned by `rotation`, where the scene does not cover `picture`. View and
/// picture are of one size.
void composite_environment(const SceneView& view, const Environment& environment,
                           const Rotation& rotation, Image& picture);

}  // namespace haarlight
