// Relights either kind of transport and looks at it: lighting updates in, a picture out.

#pragma once

#include <memory>
#include <span>

#include "core/camera.h"
#include "core/image.h"
#include "prt/lighting_update.h"
#include "prt/relight_stats.h"
#include "prt/transport.h"

namespace haarlight {

/// picture() is that of T * shown after every apply(): the pixels themselves, or the mesh drawn
/// with its vertices' radiance.
class PictureRelighter {
 public:
  /// The camera is the file's. Throws Error{invalid_argument} for a mesh of more than one term,
  /// which wants view factors that this renderer does not have.
  explicit PictureRelighter(const Transport& transport);
  ~PictureRelighter();
  PictureRelighter(PictureRelighter&&) noexcept;
  PictureRelighter& operator=(PictureRelighter&&) noexcept;

  /// From where and at which size the mesh is drawn from the next apply() on, which throws
  /// Error{invalid_argument} as MeshPicture::look does. Throws it for a picture, whose view is
  /// fixed, unless it is the same camera.
  void set_camera(const Camera& camera);
  const Camera& camera() const;

  /// Applies the update and draws what changed by it or by set_camera().
  RelightStats apply(const LightingUpdate& update);
  /// See RowSums::expect_resets.
  void expect_resets(bool expected);

  const Image& picture() const;
  /// Share of each pixel that the scene covers.
  std::span<const float> coverage() const;
  const Transport& transport() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// T * lighting in one call, drawn from `camera`, for a picture that is needed once. `lighting` is
/// layout.size() coefficients. Throws as PictureRelighter does.
Image relight_picture_once(const Transport& transport, std::span<const Rgb> lighting,
                           const Camera& camera);

}  // namespace haarlight
