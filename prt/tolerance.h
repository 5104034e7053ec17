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

/// The picture of a tile's rows under each lighting, without colours: [lighting][channel][row], one
/// channel where rgb_blocks is 0, else three, of which grey blocks use the first. `values` as in
/// TileRows.
std::vector<double> tile_pictures(const HaarLayout& layout, std::span<const float> values,
                                  unsigned rgb_blocks,
                                  std::span<const std::vector<float>> lightings);

/// What compressing did to one tile: `exact` is tile_pictures of its exact rows, `color` its rows'
/// colours.
PictureError tile_error(const HaarLayout& layout, std::span<const double> exact,
                        const CompressedTile& compressed, std::span<const Rgb> color,
                        std::span<const std::vector<float>> lightings);

}  // namespace haarlight
