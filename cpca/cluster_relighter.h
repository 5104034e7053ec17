// Relights and draws a mesh from its clusters' vectors (Overbeck 2006, section 6.3).

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "cpca/cluster_sums.h"
#include "prt/relighter.h"

namespace haarlight {

struct ClusterRelightOptions {
  /// Most of a cluster's vectors that vertices follow in a frame, for each term: 0: a quarter of
  /// the largest cluster's (Overbeck 2006, section 6.3), -1: all.
  int basis_terms = 0;
  /// Vertices of clusters that no pixel sees are left as they are until one does.
  bool skip_unseen = true;
};

/// Three steps a frame: vectors' sums follow the lighting update as any rows do (Eq. 7), vertices
/// follow the vectors (Eq. 10, see ClusterSums), view factors make radiance of them (Eq. 9) and the
/// mesh is drawn. settled() once vertices show exactly what vectors say.
class ClusterRelighter final : public Relighter {
 public:
  /// Throws Error{invalid_argument} unless the transport is of clusters, has view factors if it has
  /// terms, and basis_terms is -1 or more.
  explicit ClusterRelighter(const Transport& transport, ClusterRelightOptions options = {});
  ~ClusterRelighter() override;

  void set_camera(const Camera& camera) override;
  const Camera& camera() const override;
  RelightStats apply(const LightingUpdate& update) override;
  void expect_resets(bool expected) override;
  void keep_logs_short(bool keep) override;
  const RowSums* row_sums() const override;
  void set_exact(bool exact) override;
  bool settled() const override;
  const Image& picture() const override;
  std::span<const float> coverage() const override;
  const Transport& transport() const override;
  bool shows_rows() const override { return true; }
  void vertex_weights(std::vector<float>& weights) const override;
  std::span<const Rgb> view_factors() const override;
  void pending_rows(std::vector<double>& rows) const override;

  /// U, [vertex][term], coloured; of unseen clusters as they were last seen, with skip_unseen.
  std::span<const Rgb> sums() const;
  /// Step 2 of the last frame, and its time.
  const CombineStats& combine_stats() const;
  double combine_ms() const;
  /// Clusters that some pixel sees, a flag each.
  std::span<const std::uint8_t> seen() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A relighter for a transport of any kind: clusters by ClusterRelighter, others by
/// PictureRelighter.
RelighterFactory any_relighter(ClusterRelightOptions options = {});

}  // namespace haarlight
