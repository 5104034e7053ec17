// How much a picture changes when entries of the transport are dropped or rounded. Private to prt/.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "prt/tile_codec.h"
#include "prt/transport_writer.h"
#include "wavelet/haar.h"

namespace haarlight {

/// Sums of squares over rows and channels, colours applied, one pair a lighting.
struct PictureError {
  std::vector<double> error, energy;
  void add(const PictureError& other);
  /// Largest sqrt(error / energy) over the lightings; 0 where no light falls.
  double worst() const;
};

/// What compressing did to one tile under the given lightings.
PictureError tile_error(const HaarLayout& layout, const TileRows& exact,
                        const CompressedTile& compressed,
                        std::span<const std::vector<float>> lightings);

}  // namespace haarlight
