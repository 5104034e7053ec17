// The order in which a picture's pixels are stored as rows.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "prt/transport_writer.h"

namespace haarlight {
namespace {

// Bits of x and y interleaved: position along the Z-order curve.
std::uint64_t morton(std::uint32_t x, std::uint32_t y) {
  std::uint64_t code = 0;
  for (unsigned bit = 0; bit < 32; ++bit) {
    code |= (static_cast<std::uint64_t>(x >> bit & 1) << (2 * bit)) |
            (static_cast<std::uint64_t>(y >> bit & 1) << (2 * bit + 1));
  }
  return code;
}

}  // namespace

std::vector<std::uint32_t> image_row_order(int width, int height) {
  const auto w = static_cast<std::uint32_t>(width), h = static_cast<std::uint32_t>(height);
  const std::uint32_t tiles_x = (w + 7) / 8, tiles_y = (h + 7) / 8;
  std::vector<std::uint64_t> tiles;
  for (std::uint32_t y = 0; y < tiles_y; ++y) {
    for (std::uint32_t x = 0; x < tiles_x; ++x) tiles.push_back(morton(x, y));
  }
  std::sort(tiles.begin(), tiles.end());

  const auto chunk_tiles = static_cast<std::size_t>(kChunkTiles);
  const std::size_t chunks = (tiles.size() + chunk_tiles - 1) / chunk_tiles;
  std::vector<std::uint32_t> order(chunks * static_cast<std::size_t>(kChunkRows), kNoOutput);
  std::size_t row = 0;
  for (const std::uint64_t code : tiles) {
    std::uint32_t tx = 0, ty = 0;
    for (unsigned bit = 0; bit < 32; ++bit) {
      tx |= static_cast<std::uint32_t>(code >> (2 * bit) & 1) << bit;
      ty |= static_cast<std::uint32_t>(code >> (2 * bit + 1) & 1) << bit;
    }
    for (std::uint32_t block = 0; block < 4; ++block) {
      for (std::uint32_t i = 0; i < 16; ++i, ++row) {
        const std::uint32_t x = 8 * tx + 4 * (block & 1) + i % 4;
        const std::uint32_t y = 8 * ty + 4 * (block >> 1) + i / 4;
        if (x < w && y < h) order[row] = y * w + x;
      }
    }
  }
  return order;
}

}  // namespace haarlight
