// Relights either kind of transport and looks at it: lighting updates in, a picture out.

#pragma once

#include <memory>
#include <span>

#include "prt/relighter.h"

namespace haarlight {

/// picture() is that of T * shown after every apply(): the pixels themselves, or the mesh drawn
/// with its vertices' radiance.
class PictureRelighter final : public Relighter {
 public:
  /// The camera is the file's. Throws Error{invalid_argument} for a mesh of more than one term
  /// without view factors, and for clusters.
  explicit PictureRelighter(const Transport& transport);
  ~PictureRelighter() override;
  PictureRelighter(PictureRelighter&&) noexcept;
  PictureRelighter& operator=(PictureRelighter&&) noexcept;

  void set_camera(const Camera& camera) override;
  const Camera& camera() const override;
  RelightStats apply(const LightingUpdate& update) override;
  bool takes_parts() const override { return true; }
  RelightStats apply_first(const LightingUpdate& update) override;
  void expect_resets(bool expected) override;
  void keep_logs_short(bool keep) override;
  const Image& picture() const override;
  std::span<const float> coverage() const override;
  const Transport& transport() const override;
  bool shows_rows() const override { return true; }
  void vertex_weights(std::vector<float>& weights) const override;
  std::span<const Rgb> view_factors() const override;
  const RowSums* row_sums() const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace haarlight
