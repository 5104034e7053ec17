// Cutting an environment's picture into cells of nearly equal solid angle.

#include "wavelet/environment_cells.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <span>

namespace haarlight {
namespace {

/// How many pieces of `piece` make up `whole`, to the nearest, at least 1.
int pieces(double whole, double piece) {
  return std::max(1, static_cast<int>(std::lround(whole / piece)));
}

/// Pieces of the picture that could become one cell; each piece is at most a pixel.
using Block = std::vector<EnvironmentCell>;
using BlockSink = std::function<void(const Block&)>;

EnvironmentCell merge(const Block& block) {
  if (block.size() == 1) return block.front();
  EnvironmentCell cell;
  Vec3 moment;
  for (const EnvironmentCell& piece : block) {
    cell.energy += piece.energy;
    cell.solid_angle += piece.solid_angle;
    moment = moment + piece.center * piece.solid_angle;
  }
  cell.center = normalize(moment);
  return cell;
}

double total_solid_angle(const Block& block) {
  double sum = 0;
  for (const EnvironmentCell& piece : block) sum += piece.solid_angle;
  return sum;
}

/// How far merging carries light: | sum over pieces of (energy - mean radiance * solid angle) *
/// distance from the middle |, the largest channel standing for all.
double displacement(const Block& block) {
  if (block.size() == 1) return 0;
  const EnvironmentCell merged = merge(block);
  double sum = 0;
  for (const EnvironmentCell& piece : block) {
    const RgbD excess = piece.energy - merged.energy * (piece.solid_angle / merged.solid_angle);
    sum += std::max({std::abs(excess.r), std::abs(excess.g), std::abs(excess.b)}) *
           length(piece.center - merged.center);
  }
  return sum;
}

/// Scales the pieces of one pixel so that together they carry radiance x their solid angle.
void keep_energy(std::span<EnvironmentCell> pieces_of_pixel, const Rgb& radiance) {
  RgbD carried;
  double solid_angle = 0;
  for (const EnvironmentCell& piece : pieces_of_pixel) {
    carried += piece.energy;
    solid_angle += piece.solid_angle;
  }
  const RgbD wanted = RgbD(radiance) * solid_angle;
  const auto ratio = [](double a, double b) { return b > 0 ? a / b : 0.0; };
  const RgbD scale{ratio(wanted.r, carried.r), ratio(wanted.g, carried.g),
                   ratio(wanted.b, carried.b)};
  for (EnvironmentCell& piece : pieces_of_pixel) piece.energy = piece.energy * scale;
}

/// Lat-long pictures: strips of a part of a pixel row, or of several rows, cut into cells as wide
/// as high. Solid angles are exact: width x (cos upper edge - cos lower edge).
class LatlongCutter {
 public:
  LatlongCutter(const Environment& environment, double width)
      : picture_(environment.picture()),
        width_(width),
        pixel_height_(kPi / picture_.height),
        pixel_width_(2 * kPi / picture_.width) {}

  void run(const BlockSink& sink) {
    const int split = pieces(pixel_height_, width_);
    if (split > 1) {
      for (const Strip& strip : balanced_strips(split)) cut_strip(strip, sink);
      return;
    }
    const int merged = pieces(width_, pixel_height_);
    for (int y = 0; y < picture_.height; y += merged) {
      merge_rows(y, std::min(merged, picture_.height - y), sink);
    }
  }

 private:
  EnvironmentCell piece(double left, double right, double top, double bottom) const {
    const double middle = 0.5 * (top + bottom), half = 0.5 * (bottom - top);
    const double azimuth = 0.5 * (left + right) - kPi;
    // The mean polar angle, weighted by its sine, to second order in the height.
    const double polar = middle + half * half / 3 * std::cos(middle) / std::sin(middle);
    EnvironmentCell cell;
    cell.center = {std::sin(polar) * std::sin(azimuth), std::cos(polar),
                   -std::sin(polar) * std::cos(azimuth)};
    cell.solid_angle = (right - left) * 2 * std::sin(middle) * std::sin(half);
    return cell;
  }

  /// A strip of a pixel row, and how it blends the rows whose middles lie around it.
  struct Strip {
    double top, bottom;  // polar angles
    int low, high;       // rows; the same one beyond the last middle
    double share_high;
  };

  /// The strips of all rows, `split` to a row. Bilinear by position alone would give the rows at
  /// the poles up to 8 % too much of the sphere. So the blend is balanced: shares of a strip still
  /// sum to 1, which keeps a constant constant, and each row gets its own solid angle in all, which
  /// keeps its energy. Scaling rows and strips in turn finds that (Sinkhorn 1967).
  std::vector<Strip> balanced_strips(int split) const {
    const int rows = picture_.height;
    std::vector<Strip> strips;
    std::vector<double> solid_angle, row_wanted(static_cast<std::size_t>(rows));
    for (int j = 0; j < rows * split; ++j) {
      const double position = (j + 0.5) / split - 0.5;  // in rows, 0 at the first middle
      const int low = static_cast<int>(std::floor(position));
      Strip strip{j * pixel_height_ / split, (j + 1) * pixel_height_ / split, std::max(low, 0),
                  std::min(low + 1, rows - 1), position - low};
      solid_angle.push_back(std::cos(strip.top) - std::cos(strip.bottom));
      row_wanted[static_cast<std::size_t>(j / split)] += solid_angle.back();
      strips.push_back(strip);
    }
    // The rows away from the poles are balanced from the start; those near settle by half a step.
    constexpr int kRounds = 40;
    std::vector<double> row_scale(row_wanted.size(), 1.0), row_got;
    const std::vector<Strip> by_position = strips;
    for (int round = 0; round < kRounds; ++round) {
      row_got.assign(row_wanted.size(), 0.0);
      for (std::size_t j = 0; j < strips.size(); ++j) {
        Strip& strip = strips[j];
        const auto low = static_cast<std::size_t>(strip.low);
        const auto high = static_cast<std::size_t>(strip.high);
        const double share = by_position[j].share_high;
        const double a = (1 - share) * row_scale[low], b = share * row_scale[high];
        strip.share_high = b / (a + b);
        row_got[low] += (1 - strip.share_high) * solid_angle[j];
        row_got[high] += strip.share_high * solid_angle[j];
      }
      for (std::size_t r = 0; r < row_scale.size(); ++r) row_scale[r] *= row_wanted[r] / row_got[r];
    }
    return strips;
  }

  /// One strip of a row of pixels higher than a cell. Pixels are cut in x too, or merged with their
  /// neighbours near the poles.
  void cut_strip(const Strip& strip, const BlockSink& sink) {
    const int cuts = pieces(pixel_width_ * std::sin(0.5 * (strip.top + strip.bottom)), width_);
    const double step = pixel_width_ / cuts;
    std::vector<EnvironmentCell> row;
    for (int i = 0; i < picture_.width * cuts; ++i) {
      EnvironmentCell cell = piece(i * step, (i + 1) * step, strip.top, strip.bottom);
      cell.energy = ((1 - strip.share_high) * lookup((i + 0.5) / cuts, strip.low) +
                     strip.share_high * lookup((i + 0.5) / cuts, strip.high)) *
                    cell.solid_angle;
      row.push_back(cell);
    }
    emit_strip({&row, 1}, sink);
  }

  /// Several whole rows of pixels, together as high as a cell.
  void merge_rows(int y, int rows, const BlockSink& sink) {
    std::vector<std::vector<EnvironmentCell>> row_pieces(static_cast<std::size_t>(rows));
    for (int r = 0; r < rows; ++r) {
      for (int x = 0; x < picture_.width; ++x) {
        EnvironmentCell cell = piece(x * pixel_width_, (x + 1) * pixel_width_,
                                     (y + r) * pixel_height_, (y + r + 1) * pixel_height_);
        cell.energy = RgbD(picture_.at(x, y + r)) * cell.solid_angle;
        row_pieces[static_cast<std::size_t>(r)].push_back(cell);
      }
    }
    emit_strip(row_pieces, sink);
  }

  /// Rows of equally many pieces, cut into blocks about as wide as a cell, of equal width to one
  /// piece, so that no sliver is left at the seam.
  void emit_strip(std::span<const std::vector<EnvironmentCell>> rows, const BlockSink& sink) {
    const std::size_t count = rows.front().size();
    const std::vector<EnvironmentCell>& middle_row = rows[rows.size() / 2];
    const double around =
        2 * kPi * std::sqrt(std::max(0.0, 1 - middle_row[0].center.y * middle_row[0].center.y));
    // Three at least: the mean direction of a larger part of a ring is too far from the ring.
    const std::size_t blocks =
        std::min(count, static_cast<std::size_t>(std::max(3, pieces(around, width_))));
    Block block;
    for (std::size_t b = 0; b < blocks; ++b) {
      block.clear();
      for (std::size_t i = b * count / blocks; i < (b + 1) * count / blocks; ++i) {
        for (const std::vector<EnvironmentCell>& row : rows) block.push_back(row[i]);
      }
      sink(block);
    }
  }

  /// Linear between the pixels of row y, around the circle; x in pixels.
  RgbD lookup(double x, int y) const {
    const double floor = std::floor(x - 0.5), share = x - 0.5 - floor;
    const int w = picture_.width, x0 = static_cast<int>(floor);
    return (1 - share) * RgbD(picture_.at((x0 + w) % w, y)) +
           share * RgbD(picture_.at((x0 + 1) % w, y));
  }

  const Image& picture_;
  double width_, pixel_height_, pixel_width_;
};

/// Angular maps and crosses: every pixel is cut in k x k, or pixels are merged in squares. The
/// solid angle of a piece is its area times the projection's density at its middle.
class FlatCutter {
 public:
  FlatCutter(const Environment& environment, double width)
      : environment_(environment), picture_(environment.picture()), width_(width) {
    const bool cross = environment.projection() == Projection::vertical_cross;
    // Pixels are biggest in the middle: 2 pi across the disc, 2 (in tangent units) across a face.
    const double pixel = cross ? 6.0 / picture_.width : 2 * kPi / picture_.width;
    split_ = pieces(pixel, width);
    merge_ = pieces(width, pixel);
    tile_ = cross ? picture_.width / 3 : picture_.width;
  }

  void run(const BlockSink& sink) {
    for (int ty = 0; ty < picture_.height; ty += tile_) {
      for (int tx = 0; tx < picture_.width; tx += tile_) run_tile(tx, ty, sink);
    }
  }

 private:
  void run_tile(int tx, int ty, const BlockSink& sink) {
    Block block;
    for (int y = 0; y < tile_; y += merge_) {
      for (int x = 0; x < tile_; x += merge_) {
        block.clear();
        for (int py = y; py < std::min(y + merge_, tile_); ++py) {
          for (int px = x; px < std::min(x + merge_, tile_); ++px) {
            append_pixel(tx + px, ty + py, block);
          }
        }
        if (block.empty()) continue;
        // Near the rim of a disc a pixel covers little, whatever it was cut in.
        if (merge_ > 1 || total_solid_angle(block) < 1.5 * width_ * width_) {
          sink(block);
        } else {
          for (const EnvironmentCell& piece : block) sink({piece});
        }
      }
    }
  }

  void append_pixel(int x, int y, Block& block) {
    const std::size_t first = block.size();
    const bool centred = has_light(x, y, 0.5, 0.5);
    const bool whole = has_light(x, y, 0, 0) && has_light(x, y, 1, 0) && has_light(x, y, 0, 1) &&
                       has_light(x, y, 1, 1);
    // A pixel on the rim of the disc carries what is inside; finer pieces follow the rim.
    const int k = whole ? split_ : std::max(split_, 4);
    for (int j = 0; j < k; ++j) {
      for (int i = 0; i < k; ++i) {
        const double u = (x + (i + 0.5) / k) / picture_.width;
        const double v = (y + (j + 0.5) / k) / picture_.height;
        const std::optional<Vec3> direction = projection_direction(environment_.projection(), u, v);
        if (!direction) continue;
        EnvironmentCell piece;
        piece.center = *direction;
        piece.solid_angle = density(u, v) / (static_cast<double>(picture_.pixels.size()) * k * k);
        const Rgb radiance =
            k == 1 && centred ? picture_.at(x, y) : environment_.radiance(*direction);
        piece.energy = RgbD(radiance) * piece.solid_angle;
        block.push_back(piece);
      }
    }
    if (centred) keep_energy(std::span(block).subspan(first), picture_.at(x, y));
  }

  bool has_light(int x, int y, double dx, double dy) const {
    return projection_direction(environment_.projection(), (x + dx) / picture_.width,
                                (y + dy) / picture_.height)
        .has_value();
  }

  /// d(solid angle) / d(u v) over the whole picture's unit square.
  double density(double u, double v) const {
    if (environment_.projection() == Projection::angular) {
      // With r = angle / pi the ring dr covers sin(angle) pi dr dphi, and r dr dphi is 4 du dv.
      const double angle = kPi * std::hypot(2 * u - 1, 2 * v - 1);
      return 4 * kPi * kPi * (angle > 1e-6 ? std::max(0.0, std::sin(angle)) / angle : 1.0);
    }
    // A face is 2 x 2 in tangent units and 1/12 of the picture.
    const double a = 2 * (3 * u - std::floor(3 * u)) - 1, b = 2 * (4 * v - std::floor(4 * v)) - 1;
    const double s = 1 + a * a + b * b;
    return 48 / (s * std::sqrt(s));
  }

  const Environment& environment_;
  const Image& picture_;
  double width_;
  int split_ = 1, merge_ = 1, tile_ = 1;
};

void cut(const Environment& environment, double width, const BlockSink& sink) {
  if (environment.projection() == Projection::latlong) {
    LatlongCutter(environment, width).run(sink);
  } else {
    FlatCutter(environment, width).run(sink);
  }
}

}  // namespace

std::vector<EnvironmentCell> cut_into_cells(const Environment& environment, double solid_angle,
                                            double blur) {
  const double width = std::sqrt(solid_angle);

  // First pass: which blocks blur too much, and what bound keeps their pieces few.
  struct Candidate {
    double displacement;
    std::size_t pieces;
  };
  std::vector<Candidate> blurred;
  cut(environment, width, [&](const Block& block) {
    const double moved = displacement(block);
    if (moved > blur) blurred.push_back({moved, block.size()});
  });
  std::sort(blurred.begin(), blurred.end(),
            [](const Candidate& a, const Candidate& b) { return a.displacement > b.displacement; });
  double bound = blur;
  auto allowance = static_cast<std::size_t>(kPi / solid_angle);  // a quarter of 4 pi / solid_angle
  for (const Candidate& candidate : blurred) {
    if (candidate.pieces > allowance) {
      bound = candidate.displacement;
      break;
    }
    allowance -= candidate.pieces;
  }

  // Second pass: the cells.
  std::vector<EnvironmentCell> cells;
  cut(environment, width, [&](const Block& block) {
    if (displacement(block) > bound) {
      cells.insert(cells.end(), block.begin(), block.end());
    } else {
      cells.push_back(merge(block));
    }
  });
  return cells;
}

}  // namespace haarlight
