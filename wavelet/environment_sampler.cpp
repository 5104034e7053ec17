// Turning an environment and averaging it onto a cube map, every frame.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "core/denormals.h"
#include "core/error.h"
#include "core/parallel.h"
#include "wavelet/environment.h"
#include "wavelet/environment_cells.h"

namespace haarlight {
namespace {

/// Cells a texel that leave less than 1 % of unevenness in the solid angle that arrives; the most
/// and the least cells in all: memory above, a smooth small cube map below.
constexpr double kCellsPerTexel = 16, kMostCells = 6.3e6, kLeastCells = 6144;

/// Never fewer than this a texel, so that a footprint (below 1 texel at a cube corner) fits 2 x 2.
constexpr double kLeastCellsPerTexel = 4;

/// Blur a merged block may add, as a share of one mean texel's energy times a texel's width.
constexpr double kBlurShare = 0.005;

constexpr int kBatch = 256;         // cells turned at once, small enough for the first cache
constexpr int kTexelsAtOnce = 512;  // finished by a thread at a time

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

/// Half the width, in texels, of the box that stands for a square cell at (u, v); `width` is the
/// cell's where a texel is 1 and the face is flat. The map from the sphere to the face has
/// J J^T = s (1 + p p^T) with p = (u, v) and s = 1 + p.p: a cell's spread along u is
/// sqrt(s (1 + u^2)) times its width. Never over a texel, so that it fits in 2 x 2.
inline float half_footprint(float width, float s, float coordinate) {
  return 0.5f * std::min(width * std::sqrt(s * (1 + coordinate * coordinate)), 1.0f);
}

/// Turns `count` cells and finds their faces and footprints: no branches, several cells an
/// instruction.
void place(const RotationF& turn, const float* __restrict px, const float* __restrict py,
           const float* __restrict pz, const float* __restrict width, int count, int n,
           Footprints& prints) {
  const int face_texels = n * n;
  const auto half_n = 0.5f * static_cast<float>(n), size = static_cast<float>(n);
  int* __restrict const texel = prints.texel.data();
  int* __restrict const crosses_edge = prints.crosses_edge.data();
  float* __restrict const share_x = prints.share_x.data();
  float* __restrict const share_y = prints.share_y.data();
  for (int i = 0; i < count; ++i) {
    const float x = turn.m[0] * px[i] + turn.m[1] * py[i] + turn.m[2] * pz[i];
    const float y = turn.m[3] * px[i] + turn.m[4] * py[i] + turn.m[5] * pz[i];
    const float z = turn.m[6] * px[i] + turn.m[7] * py[i] + turn.m[8] * pz[i];
    const float ax = std::fabs(x), ay = std::fabs(y), az = std::fabs(z);
    const bool on_x = (ax >= ay) & (ax >= az);
    const bool on_y = !on_x & (ay >= az);
    // The rows of the table in cubemap.h: the axis, and what runs along u and v on its positive
    // side. On the negative side u turns around, except about Y, where v does.
    const float not_x_axis = on_y ? y : z, not_y_u = on_x ? -z : x;
    const float axis = on_x ? x : not_x_axis;
    const float along_v = on_y ? z : -y;
    const float scale = 1 / std::fabs(axis);
    const float sign = axis < 0 ? -scale : scale;
    const float u = not_y_u * (on_y ? scale : sign);
    const float v = along_v * (on_y ? sign : scale);
    const int pair = on_y ? 2 : 4;
    const int face = (on_x ? 0 : pair) + (axis < 0 ? 1 : 0);

    const float s = 1 + u * u + v * v;
    const float half_x = half_footprint(width[i], s, u);
    const float half_y = half_footprint(width[i], s, v);
    const float middle_x = (u + 1) * half_n, middle_y = (v + 1) * half_n;
    const float low_x = middle_x - half_x, high_x = middle_x + half_x;
    const float low_y = middle_y - half_y, high_y = middle_y + half_y;
    const int x0 = static_cast<int>(low_x), y0 = static_cast<int>(low_y);
    const float over_x = (high_x - static_cast<float>(x0 + 1)) / (2 * half_x);
    const float over_y = (high_y - static_cast<float>(y0 + 1)) / (2 * half_y);
    texel[i] = face * face_texels + y0 * n + x0;
    share_x[i] = over_x > 0 ? over_x : 0;
    share_y[i] = over_y > 0 ? over_y : 0;
    crosses_edge[i] = (low_x < 0) | (high_x >= size) | (low_y < 0) | (high_y >= size);
  }
}

/// The least of each channel over the pixels that carry light.
Rgb darkest(const Environment& environment) {
  const Image& picture = environment.picture();
  constexpr float kMost = std::numeric_limits<float>::max();
  Rgb least{kMost, kMost, kMost};
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const Rgb& p = picture.at(x, y);
      if (!(p.r < least.r) && !(p.g < least.g) && !(p.b < least.b)) continue;
      if (!projection_direction(environment.projection(), (x + 0.5) / picture.width,
                                (y + 0.5) / picture.height)) {
        continue;
      }
      least = {std::min(least.r, p.r), std::min(least.g, p.g), std::min(least.b, p.b)};
    }
  }
  return least.r < kMost ? least : Rgb{};
}

/// The environment less `everywhere`, where it has that much.
Environment rest_of(const Environment& environment, const Rgb& everywhere) {
  Image picture = environment.picture();
  for (Rgb& p : picture.pixels) {
    p -= everywhere;
    p = {std::max(p.r, 0.0f), std::max(p.g, 0.0f), std::max(p.b, 0.0f)};
  }
  return Environment(std::move(picture), {.projection = environment.projection(), .scale = 1});
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
  // Light that comes from everywhere alike is added at the end instead of being turned: so a
  // constant sky is constant to the last bit, and no wavelet is spent on roundings.
  everywhere_ = darkest(environment);
  const std::vector<EnvironmentCell> cells =
      cut_into_cells(rest_of(environment, everywhere_), 4 * kPi / wanted,
                     kBlurShare * mean * texel * std::sqrt(texel));

  for (const EnvironmentCell& cell : cells) {
    x_.push_back(static_cast<float>(cell.center.x));
    y_.push_back(static_cast<float>(cell.center.y));
    z_.push_back(static_cast<float>(cell.center.z));
    width_.push_back(static_cast<float>(0.5 * n_ * std::sqrt(cell.solid_angle)));
    light_.push_back(Sums{static_cast<float>(cell.energy.r), static_cast<float>(cell.energy.g),
                          static_cast<float>(cell.energy.b), static_cast<float>(cell.solid_angle)});
  }
  for (const double solid_angle : cube_solid_angles(n_)) {
    texel_solid_angle_.push_back(static_cast<float>(solid_angle));
  }
  // Each part has sums of its own for every texel: few where that is much memory, many where a
  // texel has so many cells that rounding would show.
  parts_ = n_ <= 8 ? 256 : n_ <= 128 ? 8 : n_ <= 256 ? 4 : 2;
  scratch_.resize(static_cast<std::size_t>(parts_) * part_stride());
}

void EnvironmentSampler::add_part(const Rotation& rotation, int part) const {
  const FlushDenormals flush;
  const auto n = static_cast<std::size_t>(n_);
  Sums* const sums = scratch_.data() + static_cast<std::size_t>(part) * part_stride();
  std::fill(sums, sums + part_stride(), Sums{});

  const RotationF turn(rotation);
  const auto half_n = 0.5f * static_cast<float>(n_), size = static_cast<float>(n_);

  // A box of the footprint's size around (u, v) on `face`, cut off at the face's edges.
  const auto add_inside = [&](std::size_t cell, const CubePoint& p, float share) {
    const auto u = static_cast<float>(p.u), v = static_cast<float>(p.v);
    const float s = 1 + u * u + v * v, width = std::sqrt(share) * width_[cell];
    const auto spread = [&](float c, int& first, float& second_share) {
      const float half = half_footprint(width, s, c), middle = (c + 1) * half_n;
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
        if (weight > 0) sums[cube_index(p.face, x + i, y + j, n_)] += weight * light_[cell];
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
      const double half =
          static_cast<double>(half_footprint(width_[cell], s, c)) / static_cast<double>(half_n);
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

    place(turn, x_.data() + first, y_.data() + first, z_.data() + first, width_.data() + first,
          count, n_, prints);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const std::size_t cell = first + i;
      if (prints.crosses_edge[i]) {
        add_across(cell, rotation * Vec3{x_[cell], y_[cell], z_[cell]});
        continue;
      }
      const auto texel = static_cast<std::size_t>(prints.texel[i]);
      const float right = prints.share_x[i], below = prints.share_y[i];
      const Sums here = light_[cell];
      const Sums upper = (1 - below) * here, lower = below * here;
      // Four additions cost less than guessing which are needed; a share beyond the last column or
      // row is exactly 0.
      sums[texel] += (1 - right) * upper;
      sums[texel + 1] += right * upper;
      sums[texel + n] += (1 - right) * lower;
      sums[texel + n + 1] += right * lower;
    }
  }
}

void EnvironmentSampler::project(const Rotation& rotation, Cubemap& out) const {
  if (out.n != n_ || out.texels.size() != 6 * texel_solid_angle_.size()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("cube map has faces of {}, expected {}", out.n, n_));
  }
  for (const Vec3& row : rotation.row) {
    if (!(std::abs(dot(row, row) - 1) < 1e-3)) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("a row of the rotation is ({}, {}, {}), expected length 1", row.x,
                              row.y, row.z));
    }
  }
  parallel_for(parts_, [&](int part) { add_part(rotation, part); });

  // All parts together, in a fixed order: into the first part's place. The mean radiance of what
  // arrived, energy / solid angle, goes where the second part was.
  const auto n = static_cast<std::size_t>(n_);
  Sums* const sums = scratch_.data();
  Sums* const means = scratch_.data() + part_stride();
  const int rows_at_once = std::max(1, kTexelsAtOnce / n_);
  const auto sum_parts = [&](int row) {
    const FlushDenormals flush;
    const std::size_t first = static_cast<std::size_t>(row) * n;
    for (std::size_t texel = first; texel < first + n; ++texel) {
      typedef double DoubleSums __attribute__((vector_size(32)));
      DoubleSums total = {};
      for (std::size_t part = 0; part < static_cast<std::size_t>(parts_); ++part) {
        total += __builtin_convertvector(scratch_[part * part_stride() + texel], DoubleSums);
      }
      const Sums sum = __builtin_convertvector(total, Sums);
      sums[texel] = sum;
      // Cells tile the sphere and are smaller than a texel, so something arrived everywhere.
      means[texel] = sum * (1 / sum[3]);
    }
  };
  parallel_for(6 * n_, sum_parts, rows_at_once);

  // The solid angle that arrived is uneven by up to some per cent, as cells are few and lie at all
  // angles. Divided by it, a smooth sky stays smooth, but a light in one texel loses or gains
  // energy; divided by the exact solid angle it is the other way round. So the least mean c of the
  // 3 x 3 texels around, which a light has above it, is taken as smooth and the rest as light:
  //   radiance = c + (energy - c * arrived) / exact
  const auto finish_row = [&](int row) {
    const FlushDenormals flush;
    const int face = row / n_, y = row % n_;
    for (int x = 0; x < n_; ++x) {
      const std::size_t texel = cube_index(face, x, y, n_);
      Sums least = means[texel];
      for (int ny = std::max(y - 1, 0); ny <= std::min(y + 1, n_ - 1); ++ny) {
        for (int nx = std::max(x - 1, 0); nx <= std::min(x + 1, n_ - 1); ++nx) {
          const Sums other = means[cube_index(face, nx, ny, n_)];
          least = other < least ? other : least;
        }
      }
      const Sums sum = sums[texel];
      const float exact = texel_solid_angle_[texel % (n * n)];
      const Sums radiance = least + (sum - least * sum[3]) * (1 / exact);
      // Rounding alone could leave a hair below nothing.
      out.texels[texel] =
          everywhere_ + Rgb(std::max(radiance[0], 0.0f), std::max(radiance[1], 0.0f),
                            std::max(radiance[2], 0.0f));
    }
  };
  parallel_for(6 * n_, finish_row, rows_at_once);
}

Cubemap environment_to_cubemap(const Environment& environment, int face_size,
                               const Rotation& rotation) {
  const EnvironmentSampler sampler(environment, face_size);
  Cubemap result(face_size);
  sampler.project(rotation, result);
  return result;
}

}  // namespace haarlight
