// The fixed directions along which every shading point looks: a few in each cube texel.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// A place inside a texel, (0, 0) its corner of lowest u and v, (1, 1) the opposite one.
struct TexelPlace {
  double u = 0, v = 0;
};

/// `count` well spread places in a texel, one in each of `count` columns and in each of `count`
/// rows, the one nearest the middle first. A fixed pattern, so that neighbouring rows of a
/// transport differ by what the scene does and not by noise, which would not compress.
std::vector<TexelPlace> texel_places(int count);

/// Index of the texel of an n x n cube map that a direction falls into.
std::size_t texel_of(const Vec3& direction, int n);

/// Directions of all texels of a cube map with `samples` each, and what is needed to trace the
/// first of each eight at a time. The same for every shading point; immutable.
struct DirectionTable {
  /// `face_size` is a power of two, at least 4; `samples` at least 1.
  DirectionTable(int face_size, int samples);

  struct Sample {
    float x, y, z;      ///< unit direction
    float solid_angle;  ///< sr; the texel's exact solid angle shared by the density at the sample
  };

  /// First samples of a patch of 4x2 texels, lane i being column i % 4 of row i / 4.
  struct alignas(32) Packet {
    float x[8], y[8], z[8];     ///< unit direction of the texel's first sample
    float cx[8], cy[8], cz[8];  ///< unit direction of the texel's centre
    float radius;               ///< no direction of a texel is farther (chord) from its centre
    std::int32_t top, bottom;   ///< texel index of lanes 0 and 4
  };

  /// A square of at most 8x8 texels: packets [first, first + count).
  struct Group {
    float x, y, z;  ///< unit axis
    float radius;   ///< no direction of the group is farther (chord) from the axis
    std::int32_t first, count;
  };

  int n = 0;
  int samples = 0;
  std::vector<Sample> sample;  ///< [texel][sample]
  /// The same as [sample][texel], an array a number.
  std::vector<float> plane_x, plane_y, plane_z, plane_solid_angle;
  std::vector<Packet> packet;
  std::vector<Group> group;
  /// Per texel: sum of direction * solid angle over its samples. Dotted with a normal it is the
  /// cosine-weighted solid angle of a texel wholly above the horizon.
  std::vector<float> moment_x, moment_y, moment_z;
  /// Pairs of texels that touch across an edge of the cube.
  std::vector<std::array<std::int32_t, 2>> seam;

  std::size_t texels() const { return moment_x.size(); }
};

}  // namespace haarlight
