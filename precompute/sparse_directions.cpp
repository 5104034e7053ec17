// A sixteenth of all directions at a time, for points whose light is only needed on average.

#include "precompute/sparse_directions.h"

#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

// Even bits of a Morton code.
int compact_bits(int code) {
  int out = 0;
  for (int b = 0; b < 16; ++b) out |= (code >> (2 * b) & 1) << b;
  return out;
}

}  // namespace

SparseDirections::SparseDirections(const DirectionTable& table) : samples_(table.samples) {
  const int side = table.n / 4;  // squares along a face
  const auto squares = static_cast<std::size_t>(6 * side * side);
  slots_ = (squares + 7) / 8 * 8;
  texels_.assign(kPhases * slots_, -1);
  packets_.assign(static_cast<std::size_t>(kPhases * samples_) * (slots_ / 8), Packet{});
  const auto per_texel = static_cast<std::size_t>(samples_);
  for (int phase = 0; phase < kPhases; ++phase) {
    std::size_t slot = 0;
    for (int face = 0; face < 6; ++face) {
      for (int code = 0; code < side * side; ++code, ++slot) {  // neighbours share packets
        const int x = 4 * compact_bits(code) + phase % 4,
                  y = 4 * compact_bits(code >> 1) + phase / 4;
        const std::size_t texel = cube_index(face, x, y, table.n);
        texels_[static_cast<std::size_t>(phase) * slots_ + slot] = static_cast<std::int32_t>(texel);
        for (std::size_t s = 0; s < per_texel; ++s) {
          const DirectionTable::Sample& d = table.sample[texel * per_texel + s];
          Packet& p =
              packets_[(static_cast<std::size_t>(phase) * per_texel + s) * (slots_ / 8) + slot / 8];
          p.x[slot % 8] = d.x, p.y[slot % 8] = d.y, p.z[slot % 8] = d.z;
          p.weight[slot % 8] = d.solid_angle * static_cast<float>(kPhases * samples_);
        }
      }
    }
    for (; slot < slots_; ++slot) {  // padding looks somewhere, and counts nothing
      for (std::size_t s = 0; s < per_texel; ++s) {
        packets_[(static_cast<std::size_t>(phase) * per_texel + s) * (slots_ / 8) + slot / 8]
            .z[slot % 8] = 1;
      }
    }
  }
}

}  // namespace haarlight
