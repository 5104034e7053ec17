// A sixteenth of all directions at a time, for points whose light is only needed on average.

#pragma once

#include <cstdint>
#include <vector>

#include "precompute/direction_table.h"

namespace haarlight {

/// The texels of a cube map dealt out to 16 phases, one of each 4x4 square. A point that looks into
/// one phase only, chosen evenly at random, and counts what it finds 16-fold, is right on average
/// for every texel; so is looking through one sample of a texel counted for all of them.
class SparseDirections {
 public:
  static constexpr int kPhases = 16;

  explicit SparseDirections(const DirectionTable& table);

  /// Eight directions; lanes of slots [8 p, 8 p + 8) of packet p.
  struct alignas(32) Packet {
    float x[8], y[8], z[8];  ///< unit
    float weight[8];         ///< sr: the texel's solid angle times kPhases; 0: no direction
  };

  int samples() const { return samples_; }
  /// Slots of a phase: 6 (n / 4)^2, rounded up to packets of eight.
  std::size_t slots() const { return slots_; }
  /// Packets of a phase through sample `s` of its texels: slots() / 8 of them.
  const Packet* packets(int phase, int s) const {
    return packets_.data() + (static_cast<std::size_t>(phase) * static_cast<std::size_t>(samples_) +
                              static_cast<std::size_t>(s)) *
                                 (slots_ / 8);
  }
  /// Which texel a slot stands for, or -1 for padding: slots() entries.
  const std::int32_t* texels(int phase) const {
    return texels_.data() + static_cast<std::size_t>(phase) * slots_;
  }

 private:
  int samples_;
  std::size_t slots_;
  std::vector<Packet> packets_;
  std::vector<std::int32_t> texels_;
};

}  // namespace haarlight
