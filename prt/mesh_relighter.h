// Relights the vertices of a mesh: a row of T is a vertex, seen alike from everywhere.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "prt/relight_stats.h"
#include "prt/row_sums.h"

namespace haarlight {

/// radiance() == T * shown after every apply().
class MeshRelighter {
 public:
  /// Throws Error{invalid_argument} for the transport of a picture.
  explicit MeshRelighter(Transport transport);

  /// See RowSums::apply for parts.
  RelightStats apply(const LightingUpdate& update, UpdatePart part = UpdatePart::whole);
  /// See RowSums::expect_resets.
  void expect_resets(bool expected) { sums_.expect_resets(expected); }
  void keep_logs_short(bool keep) { sums_.keep_logs_short(keep); }
  const RowSums& sums() const { return sums_; }
  /// One an output, W m^-2 sr^-1: vertex * terms + term, so one a vertex where terms is 1.
  std::span<const Rgb> radiance() const { return radiance_; }
  const Transport& transport() const { return sums_.transport(); }
  std::uint64_t extra_bytes() const { return sums_.extra_bytes(); }

 private:
  RowSums sums_;
  std::vector<Rgb> radiance_;
};

}  // namespace haarlight
