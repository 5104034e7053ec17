// Relights a fixed view (Overbeck 2006, section 6.1): a row of T is a pixel.

#pragma once

#include "core/image.h"
#include "prt/row_sums.h"
#include "wavelet/environment.h"

namespace haarlight {

/// Time and traffic of one frame.
struct RelightStats {
  ApplyStats apply;
  double apply_ms = 0;   ///< streaming columns into sums
  double finish_ms = 0;  ///< sums to pixels, done chunk by chunk while they are in cache; both are
                         ///< shares of the frame's wall time
};

/// picture() == T * shown after every apply(): the radiance of the scene, nothing where it is not.
class ImageRelighter {
 public:
  explicit ImageRelighter(Transport transport);

  RelightStats apply(const LightingUpdate& update);
  /// See RowSums::expect_resets.
  void expect_resets(bool expected) { sums_.expect_resets(expected); }
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

/// Draws `environment`, turned by `rotation`, where the scene does not cover `picture`.
void composite_environment(const Transport& transport, const Environment& environment,
                           const Rotation& rotation, Image& picture);

}  // namespace haarlight
