// Which records are near a patch of surface: a tree of boxes over places and normals.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// A place over the unit of equation 5's distance, and a normal over sqrt 2: as |n - n_k|^2 =
/// 2 (1 - n . n_k), both parts of 1 / w_k are plain distances between coordinates (Debattista and
/// others 2009, equation 5). The fourth and eighth are 0.
using SurfaceCoordinates = std::array<float, 8>;
SurfaceCoordinates surface_coordinates(const Vec3& position, const Vec3& normal, double per_unit);

/// A range of each coordinate.
struct SurfaceBox {
  SurfaceCoordinates low, high;

  static SurfaceBox nothing();
  void add(const SurfaceCoordinates& c);
  /// The widest coordinate.
  std::size_t widest() const;
  float width(std::size_t axis) const { return high[axis] - low[axis]; }
  /// Whether no place of one and record of the other have 1 / w_k below `reach`.
  bool beyond(const SurfaceBox& other, float reach) const;
};

/// Eight records side by side; where there are fewer, coordinates of kNowhere.
struct alignas(32) RecordBlock {
  static constexpr float kNowhere = 1e15f;
  std::array<std::array<float, 8>, 6> at{};     ///< of SurfaceCoordinates, without the zeros
  std::array<std::array<float, 8>, 3> light{};  ///< irradiance
  std::array<std::uint32_t, 8> number{};
  std::uint32_t size = 0;
};

/// Made of all records at once; halves of about equal number at each level, however many lie in one
/// place. A plain value.
class RecordIndex {
 public:
  struct Entry {
    SurfaceCoordinates at{};
    std::uint32_t number = 0;
  };

  void build(std::vector<Entry> entries);
  bool empty() const { return block_.empty(); }
  /// Asks `light` for each record's irradiance, by its number.
  template <typename Light>
  void set_light(const Light& light) {
    for (RecordBlock& block : block_) {
      for (std::size_t i = 0; i < block.size; ++i) {
        const Rgb e = light(block.number[i]);
        block.light[0][i] = e.r, block.light[1][i] = e.g, block.light[2][i] = e.b;
      }
    }
  }
  /// Appends the blocks of all records whose 1 / w_k is below `reach` for a place in the box.
  void near(const SurfaceBox& box, float reach, std::vector<const RecordBlock*>& out) const;

 private:
  struct Node {
    SurfaceBox box;
    std::uint32_t child = 0;  // two of them, beside each other; 0: a leaf
    std::uint32_t block = 0;  // of a leaf
  };
  void split(std::size_t node, std::span<Entry> entries);

  std::vector<RecordBlock> block_;
  std::vector<Node> node_;
};

}  // namespace haarlight
