// Relighting with spherical harmonics instead of wavelets (Sloan, Kautz, Snyder 2002), exact or
// incremental per band (Overbeck 2006, section 7): what the wavelet methods are compared with.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/huge_page_vector.h"
#include "core/image.h"
#include "prt/relight_stats.h"
#include "prt/spherical_harmonics.h"
#include "prt/transport.h"

namespace haarlight {

struct ShOptions {
  int order = 5;             ///< order^2 functions
  bool incremental = false;  ///< else every function in every frame
  int terms = 6;             ///< most functions changed in a frame, where incremental; >= 1
};

/// T_sh = T * Haar * Y, column by column; a column is dense. picture() == T_sh * shown, shown being
/// the projection of the light or, incrementally, what has followed it: as PBI does with wavelets,
/// a degree is a band, each is kept or reset by which leaves less (L1, weighted by the norms of
/// columns), and the terms with the largest change go first.
class ShRelighter {
 public:
  /// Makes the columns, a float a row (three where colour does not factor out) each. Throws
  /// Error{invalid_argument} for a mesh, or options out of range.
  ShRelighter(const Transport& transport, const ShOptions& options);

  struct Frame {
    int updates = 0;       ///< functions changed
    std::string resets;    ///< a digit a degree
    double update_ms = 0;  ///< projection and choice
    RelightStats stats;
  };
  /// Towards `target`, Haar coefficients as everywhere. `exact` shows all of its projection.
  Frame relight(std::span<const Rgb> target, bool exact);

  const Image& picture() const { return picture_; }
  std::span<const RgbD> shown() const { return shown_; }
  std::uint64_t column_bytes() const { return channels_ * rows_ * sizeof(float); }

 private:
  struct Delta {
    std::size_t function;
    RgbD delta;
  };
  void choose(std::span<const RgbD> wanted, Frame& frame);
  void add(std::span<const Delta> deltas, bool from_zero);
  void finish();

  Transport transport_;
  ShOptions options_;
  ShProjection projection_;
  std::size_t rows_, channels_;    // channels of a column: 1, or 3 if any block is RGB
  HugePageVector<float> columns_;  // [function][block][channel][row of block]
  std::vector<double> norm_;       // of columns, colours applied
  HugePageVector<double> totals_;  // [block][channel][row of block]
  std::vector<RgbD> wanted_, shown_;
  std::vector<Delta> deltas_;
  Image picture_;
};

}  // namespace haarlight
