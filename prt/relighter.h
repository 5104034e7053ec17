// What relights a transport and looks at it, whatever its rows are: lighting updates in, a picture
// out.

#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "prt/lighting_update.h"
#include "prt/relight_stats.h"
#include "prt/row_sums.h"
#include "prt/transport.h"

namespace haarlight {

/// After apply(), picture() is that of T * shown, or, of a renderer that follows its sums step by
/// step, on its way there until settled().
class Relighter {
 public:
  virtual ~Relighter() = default;

  /// From where and at which size a mesh is drawn from the next apply() on, which throws
  /// Error{invalid_argument} as MeshPicture::look does. Throws it for a picture, whose view is
  /// fixed, unless it is the same camera.
  virtual void set_camera(const Camera& camera) = 0;
  virtual const Camera& camera() const = 0;

  /// Applies the update and draws what changed by it or by set_camera().
  virtual RelightStats apply(const LightingUpdate& update) = 0;
  /// Whether a frame's update may come in two parts: apply_first(), which leaves the picture as it
  /// is, and apply() for the rest, which may be empty.
  virtual bool takes_parts() const { return false; }
  /// The first part. Requires takes_parts(), and that the next call is apply().
  virtual RelightStats apply_first(const LightingUpdate& update) {
    static_cast<void>(update);
    return {};
  }
  /// See RowSums::expect_resets.
  virtual void expect_resets(bool expected) = 0;
  /// See RowSums::keep_logs_short.
  virtual void keep_logs_short(bool keep) = 0;
  /// Whether the next apply() shows T * shown in full, at whatever cost, rather than step by step.
  /// For renderers that always do, nothing.
  virtual void set_exact(bool exact) { static_cast<void>(exact); }
  /// Whether the picture is that of T * shown, so that an empty update leaves it as it is.
  virtual bool settled() const { return true; }

  virtual const Image& picture() const = 0;
  /// Share of each pixel that the scene covers.
  virtual std::span<const float> coverage() const = 0;
  virtual const Transport& transport() const = 0;

  /// Whether a pixel is a row of T, or a mean of vertices made of rows, so that an ErrorJudge can
  /// judge the picture. If so, of a mesh: what it is made of (PictureView), as last drawn.
  virtual bool shows_rows() const { return false; }
  virtual void vertex_weights(std::vector<float>& weights) const { weights.clear(); }
  virtual std::span<const Rgb> view_factors() const { return {}; }
  /// What it has yet to follow: see ErrorJudge::set_pending.
  virtual void pending_rows(std::vector<double>& rows) const { rows.clear(); }
  /// The sums of T's rows, for what the next apply() would move; null where there are none.
  virtual const RowSums* row_sums() const { return nullptr; }

 protected:
  Relighter() = default;
  Relighter(Relighter&&) = default;
  Relighter& operator=(Relighter&&) = default;
};

/// Makes what relights a transport; throws as the relighter's constructor does. Modules above prt/
/// bring renderers of their own this way. An empty one stands for PictureRelighter.
using RelighterFactory = std::function<std::unique_ptr<Relighter>(const Transport& transport)>;

std::unique_ptr<Relighter> make_relighter(const RelighterFactory& make, const Transport& transport);

/// T * lighting in one call, drawn from `camera`, for a picture that is needed once. `lighting` is
/// layout.size() coefficients. Throws as what `make` makes does.
Image relight_picture_once(const Transport& transport, std::span<const Rgb> lighting,
                           const Camera& camera, const RelighterFactory& make = {});

}  // namespace haarlight
