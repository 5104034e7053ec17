// A part of the sky at a time, for points whose light is only needed on average.

#pragma once

#include <cstdint>
#include <vector>

#include "precompute/direction_table.h"

namespace haarlight {

/// The sky in squares of texels, dealt out to phases. A point that looks into one phase only,
/// chosen evenly at random, through a random place of each of its squares, and counts what it finds
/// once for every phase, is right on average for the mean of every square.
class SparseDirections {
 public:
  /// Directions of `table` in squares such that a face has `resolution` squares along an edge: a
  /// power of two, at most table.n. Phases are as many as leave 8 by 8 squares of a face in one.
  SparseDirections(const DirectionTable& table, int resolution);

  /// Eight directions; slots [8 p, 8 p + 8) are the lanes of packet p.
  struct alignas(32) Packet {
    float x[8], y[8], z[8];  ///< unit
    float weight[8];         ///< sr: the square's solid angle times phases(); 0: no direction
  };

  int phases() const { return phases_; }
  /// Places in a square; the packets of one place hold one place of each square.
  int places() const { return places_; }
  /// Slots of a phase, a square each, rounded up to packets of eight.
  std::size_t slots() const { return slots_; }
  /// slots() / 8 packets.
  const Packet* packets(int phase, int place) const {
    return packets_.data() + (static_cast<std::size_t>(phase) * static_cast<std::size_t>(places_) +
                              static_cast<std::size_t>(place)) *
                                 (slots_ / 8);
  }
  /// Per texel: phase * slots() + slot of its square, and its share of the square's solid angle.
  const std::vector<std::int32_t>& square() const { return square_; }
  const std::vector<float>& share() const { return share_; }

 private:
  int phases_, places_;
  std::size_t slots_;
  std::vector<Packet> packets_;
  std::vector<std::int32_t> square_;
  std::vector<float> share_;
};

}  // namespace haarlight
