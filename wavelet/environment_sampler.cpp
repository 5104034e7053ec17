// Turning an environment and averaging it onto a cube map, every frame.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "wavelet/environment.h"
#include "wavelet/environment_cells.h"

namespace haarlight {
namespace {

/// Cells a texel that leave less than 1 % of unevenness in the solid angle that arrives; the most
/// and the least cells in all: memory above, a smooth small cube map below.
constexpr double kCellsPerTexel = 16, kMostCells = 6.3e6, kLeastCells = 24576;

/// Never fewer than this a texel, so that a footprint (below 1 texel at a cube corner) fits 2 x 2.
constexpr double kLeastCellsPerTexel = 4;

/// Blur a merged block may add, as a share of one mean texel's energy times a texel's width.
constexpr double kBlurShare = 0.005;

constexpr int kBatch = 256;        // cells turned at once, small enough for the first cache
constexpr int kStripTexels = 512;  // texels divided at once

/// Where footprints of a batch lie: the first texel of 2 x 2, the share of the second column and
/// row, or a mark that it reaches over an edge of the face.
struct Footprints {
  alignas(32) std::array<int, kBatch> texel;
  alignas(32) std::array<float, kBatch> share_x, share_y;
  alignas(32) std::array<int, kBatch> crosses_edge;
};

struct RotationF {
  float m[9];
  explicit RotationF(const Rotation& r) {
    for (std::size_t i = 0; i < 3; ++i) {
      m[3 * i] = static_cast<float>(r.row[i].x);
      m[3 * i + 1] = static_cast<float>(r.row[i].y);
      m[3 * i + 2] = static_cast<float>(r.row[i].z);
    }
  }
};

/// Half the width, in texels, of the box that stands for a square cell of `solid_angle` at (u, v).
/// The map from the sphere to the face has J J^T = s (1 + p p^T) with p = (u, v) and s = 1 + p.p:
/// a cell's spread along u is sqrt(s (1 + u^2)) times its width.
inline float half_footprint(float solid_angle, float s, float coordinate, float half_n) {
  const float width = half_n * std::sqrt(solid_angle * s * (1 + coordinate * coordinate));
  return 0.5f * std::min(width, 1.0f);
}

}  // namespace

EnvironmentSampler::EnvironmentSampler(const Environment& environment, int face_size)
    : n_(face_size) {
  if (face_size < 1 || face_size > 1024 || !std::has_single_bit(static_cast<unsigned>(face_size))) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("face size is {}, expected a power of two from 1 to 1024", face_size));
  }
  const double texels = 6.0 * n_ * n_;
  const double wanted = std::max(
      {std::min(kCellsPerTexel * texels, kMostCells), kLeastCells, kLeastCellsPerTexel * texels});

  double mean = 0;
  for (const Rgb& pixel : environment.picture().pixels) {
    mean += std::max({pixel.r, pixel.g, pixel.b}) /
            static_cast<double>(environment.picture().pixels.size());
  }
  const double texel = 4 * kPi / texels;
  const std::vector<EnvironmentCell> cells =
      cut_into_cells(environment, 4 * kPi / wanted, kBlurShare * mean * texel * std::sqrt(texel));

  for (const EnvironmentCell& cell : cells) {
    x_.push_back(static_cast<float>(cell.center.x));
    y_.push_back(static_cast<float>(cell.center.y));
    z_.push_back(static_cast<float>(cell.center.z));
    red_.push_back(static_cast<float>(cell.energy.r));
    green_.push_back(static_cast<float>(cell.energy.g));
    blue_.push_back(static_cast<float>(cell.energy.b));
    solid_angle_.push_back(static_cast<float>(cell.solid_angle));
  }
  parts_ = n_ <= 128 ? 8 : n_ <= 256 ? 4 : 2;  // each has sums of its own for every texel
  scratch_.resize(static_cast<std::size_t>(parts_) * 6 * static_cast<std::size_t>(n_) *
                  static_cast<std::size_t>(n_));
}

void EnvironmentSampler::add_part(const Rotation& rotation, int part) const {
  const auto n = static_cast<std::size_t>(n_);
  const std::size_t texels = 6 * n * n;
  TexelSum* const sums = scratch_.data() + static_cast<std::size_t>(part) * texels;
  std::fill(sums, sums + texels, TexelSum{});

  const RotationF turn(rotation);
  const int face_texels = n_ * n_;
  const auto half_n = 0.5f * static_cast<float>(n_), size = static_cast<float>(n_);

  const auto add = [&](std::size_t cell, std::size_t texel, float weight) {
    const float values[4] = {red_[cell], green_[cell], blue_[cell], solid_angle_[cell]};
    for (int i = 0; i < 4; ++i) sums[texel].part[i] += weight * values[i];
  };
  // A box of the footprint's size around (u, v) on `face`, cut off at the face's edges.
  const auto add_inside = [&](std::size_t cell, const CubePoint& p, float share) {
    const auto u = static_cast<float>(p.u), v = static_cast<float>(p.v);
    const float s = 1 + u * u + v * v, solid_angle = share * solid_angle_[cell];
    const auto spread = [&](float c, int& first, float& second_share) {
      const float half = half_footprint(solid_angle, s, c, half_n), middle = (c + 1) * half_n;
      const float low = std::max(middle - half, 0.0f), high = std::min(middle + half, size);
      first = std::min(static_cast<int>(low), n_ - 1);
      second_share =
          high > low ? std::max(0.0f, (high - static_cast<float>(first + 1)) / (high - low)) : 0.0f;
    };
    int x, y;
    float share_x, share_y;
    spread(u, x, share_x);
    spread(v, y, share_y);
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) {
        const float weight = share * (i ? share_x : 1 - share_x) * (j ? share_y : 1 - share_y);
        if (weight > 0) add(cell, cube_index(p.face, x + i, y + j, n_), weight);
      }
    }
  };
  // A footprint over an edge: what lies beyond goes to the face that the direction there is on.
  const auto add_across = [&](std::size_t cell, const Vec3& direction) {
    const CubePoint p = cube_point(direction);
    const auto u = static_cast<float>(p.u), v = static_cast<float>(p.v);
    const float s = 1 + u * u + v * v;
    struct Piece {
      double middle, share;
    };
    const auto cut = [&](float c, std::array<Piece, 2>& piece) {
      const double half = static_cast<double>(half_footprint(solid_angle_[cell], s, c, half_n)) /
                          static_cast<double>(half_n);
      const double low = static_cast<double>(c) - half, high = static_cast<double>(c) + half;
      const double inner_low = std::max(low, -1.0), inner_high = std::min(high, 1.0);
      const double outer = 1 - (inner_high - inner_low) / (2 * half);
      piece[0] = {0.5 * (inner_low + inner_high), 1 - outer};
      piece[1] = {low < -1 ? 0.5 * (low - 1) : 0.5 * (high + 1), outer};
    };
    std::array<Piece, 2> across, down;
    cut(u, across);
    cut(v, down);
    for (const Piece& b : down) {
      for (const Piece& a : across) {
        const auto share = static_cast<float>(a.share * b.share);
        if (share <= 0) continue;
        add_inside(cell, cube_point(cube_direction({p.face, a.middle, b.middle})), share);
      }
    }
  };

  Footprints prints;
  const std::size_t begin =
      cell_count() * static_cast<std::size_t>(part) / static_cast<std::size_t>(parts_);
  const std::size_t end =
      cell_count() * static_cast<std::size_t>(part + 1) / static_cast<std::size_t>(parts_);
  for (std::size_t first = begin; first < end; first += kBatch) {
    const auto count = static_cast<int>(std::min<std::size_t>(kBatch, end - first));
    const float* const px = x_.data() + first;
    const float* const py = y_.data() + first;
    const float* const pz = z_.data() + first;
    const float* const pw = solid_angle_.data() + first;

    // Turn, find the face and the footprint: no branches, several cells an instruction.
    for (int i = 0; i < count; ++i) {
      const float x = turn.m[0] * px[i] + turn.m[1] * py[i] + turn.m[2] * pz[i];
      const float y = turn.m[3] * px[i] + turn.m[4] * py[i] + turn.m[5] * pz[i];
      const float z = turn.m[6] * px[i] + turn.m[7] * py[i] + turn.m[8] * pz[i];
      const float ax = std::abs(x), ay = std::abs(y), az = std::abs(z);
      const bool on_x = (ax >= ay) & (ax >= az);
      const bool on_y = !on_x & (ay >= az);
      // The face's rows of cubemap.h: the axis, and what runs along u and v on its positive side.
      const float axis = on_x ? x : on_y ? y : z;
      const float along_u = on_x ? -z : x;
      const float along_v = on_y ? z : -y;
      const bool negative = axis < 0;
      const float scale = 1 / std::abs(axis);
      // On the negative side u turns around, except about Y, where v does.
      const float u = (negative & !on_y ? -along_u : along_u) * scale;
      const float v = (negative & on_y ? -along_v : along_v) * scale;
      const int face = (on_x ? 0 : on_y ? 2 : 4) + (negative ? 1 : 0);

      const float s = 1 + u * u + v * v;
      const float half_x = half_footprint(pw[i], s, u, half_n);
      const float half_y = half_footprint(pw[i], s, v, half_n);
      const float middle_x = (u + 1) * half_n, middle_y = (v + 1) * half_n;
      const float low_x = middle_x - half_x, high_x = middle_x + half_x;
      const float low_y = middle_y - half_y, high_y = middle_y + half_y;
      const int x0 = static_cast<int>(low_x), y0 = static_cast<int>(low_y);
      const float over_x = (high_x - static_cast<float>(x0 + 1)) / (2 * half_x);
      const float over_y = (high_y - static_cast<float>(y0 + 1)) / (2 * half_y);
      const auto at = static_cast<std::size_t>(i);
      prints.texel[at] = face * face_texels + y0 * n_ + x0;
      prints.share_x[at] = over_x > 0 ? over_x : 0;
      prints.share_y[at] = over_y > 0 ? over_y : 0;
      prints.crosses_edge[at] =
          (low_x < 0) | (high_x >= size) | (low_y < 0) | (high_y >= size) ? 1 : 0;
    }

    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const std::size_t cell = first + i;
      if (prints.crosses_edge[i]) {
        add_across(cell, rotation * Vec3{x_[cell], y_[cell], z_[cell]});
        continue;
      }
      const auto texel = static_cast<std::size_t>(prints.texel[i]);
      const float right = prints.share_x[i], below = prints.share_y[i];
      add(cell, texel, (1 - right) * (1 - below));
      if (right > 0) add(cell, texel + 1, right * (1 - below));
      if (below > 0) {
        add(cell, texel + n, (1 - right) * below);
        if (right > 0) add(cell, texel + n + 1, right * below);
      }
    }
  }
}

void EnvironmentSampler::project(const Rotation& rotation, Cubemap& out) const {
  if (out.n != n_) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("cube map has faces of {}, expected {}", out.n, n_));
  }
  parallel_for(parts_, [&](int part) { add_part(rotation, part); });

  const std::size_t texels = out.texels.size();
  const auto strips = static_cast<int>((texels + kStripTexels - 1) / kStripTexels);
  parallel_for(strips, [&](int strip) {
    const std::size_t first = static_cast<std::size_t>(strip) * kStripTexels;
    const std::size_t last = std::min(first + kStripTexels, texels);
    for (std::size_t texel = first; texel < last; ++texel) {
      TexelSum sum = scratch_[texel];
      for (std::size_t part = 1; part < static_cast<std::size_t>(parts_); ++part) {
        for (int i = 0; i < 4; ++i) sum.part[i] += scratch_[part * texels + texel].part[i];
      }
      // Cells tile the sphere and are smaller than a texel, so something arrived everywhere.
      const float scale = 1 / sum.part[3];
      out.texels[texel] = {sum.part[0] * scale, sum.part[1] * scale, sum.part[2] * scale};
    }
  });
}

Cubemap environment_to_cubemap(const Environment& environment, int face_size,
                               const Rotation& rotation) {
  const EnvironmentSampler sampler(environment, face_size);
  Cubemap result(face_size);
  sampler.project(rotation, result);
  return result;
}

}  // namespace haarlight
