// A part of the sky at a time, for points whose light is only needed on average.

#include "precompute/sparse_directions.h"

#include <algorithm>

#include "precompute/random.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

constexpr int kSidePerPhase = 8;
constexpr int kMostPlaces = 16;

// Even bits of a Morton code.
int compact_bits(int code) {
  int out = 0;
  for (int b = 0; b < 16; ++b) out |= (code >> (2 * b) & 1) << b;
  return out;
}

}  // namespace

SparseDirections::SparseDirections(const DirectionTable& table, int resolution) {
  const int n = table.n;
  const int width = n / resolution;  // of a square, texels
  const int stride =
      std::max(1, resolution / kSidePerPhase);  // squares of a phase lie so far apart
  const int side = resolution / stride;         // squares of a phase along a face
  phases_ = stride * stride;
  const int directions = width * width * table.samples;  // in a square
  places_ = std::min(kMostPlaces, directions);
  slots_ = (static_cast<std::size_t>(6 * side * side) + 7) / 8 * 8;
  square_.assign(table.texels(), 0);
  share_.assign(table.texels(), 0.0f);
  packets_.assign(static_cast<std::size_t>(phases_ * places_) * (slots_ / 8), Packet{});
  const std::vector<double> solid_angle = cube_solid_angles(n);
  const auto per_texel = static_cast<std::size_t>(table.samples);
  for (int phase = 0; phase < phases_; ++phase) {
    std::size_t slot = 0;
    const auto packet = [&](int place) -> Packet& {
      return packets_[static_cast<std::size_t>(phase * places_ + place) * (slots_ / 8) + slot / 8];
    };
    for (int face = 0; face < 6; ++face) {
      for (int code = 0; code < side * side; ++code, ++slot) {  // neighbours share packets
        const int x0 = width * (stride * compact_bits(code) + phase % stride);
        const int y0 = width * (stride * compact_bits(code >> 1) + phase / stride);
        double whole = 0;
        for (int i = 0; i < width * width; ++i) {
          whole += solid_angle[cube_index(0, x0 + i % width, y0 + i / width, n)];
        }
        for (int i = 0; i < width * width; ++i) {
          const int x = x0 + i % width, y = y0 + i / width;
          const std::size_t texel = cube_index(face, x, y, n);
          square_[texel] =
              static_cast<std::int32_t>(static_cast<std::size_t>(phase) * slots_ + slot);
          share_[texel] = static_cast<float>(solid_angle[cube_index(0, x, y, n)] / whole);
        }
        // All directions of the square if there are few, else some of them at random, other ones in
        // other squares.
        for (int place = 0; place < places_; ++place) {
          int chosen = place;
          if (directions > places_) {
            const std::uint64_t bits =
                mix_bits(slot * kMostPlaces + static_cast<std::size_t>(place),
                         static_cast<std::uint64_t>(phase));
            // One of each of places_ equal runs of directions.
            chosen = static_cast<int>((place + unit_number(bits)) * directions / places_);
          }
          const int i = chosen / table.samples;
          const std::size_t texel = cube_index(face, x0 + i % width, y0 + i / width, n);
          const DirectionTable::Sample& d =
              table.sample[texel * per_texel + static_cast<std::size_t>(chosen % table.samples)];
          Packet& p = packet(place);
          p.x[slot % 8] = d.x, p.y[slot % 8] = d.y, p.z[slot % 8] = d.z;
          p.weight[slot % 8] = static_cast<float>(whole * phases_);
        }
      }
    }
    for (; slot < slots_; ++slot) {  // padding looks somewhere, and counts nothing
      for (int place = 0; place < places_; ++place) packet(place).z[slot % 8] = 1;
    }
  }
}

}  // namespace haarlight
