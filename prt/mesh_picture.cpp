// A mesh with a radiance at each vertex -> a picture from any camera: a small software rasteriser.
//
// Pixel coordinates are (x / w, y / w) of a vertex (x, y, w) in homogeneous ones, w its depth. With
// h_i the corners of a triangle and p = (px, py, 1) a place in the picture,
//
//   e_0 = (h_1 x h_2) . p,  and so on round;   lambda_i = e_i / det(h_0, h_1, h_2)
//   p sees the triangle where all lambda_i >= 0, at depth 1 / (lambda_0 + lambda_1 + lambda_2)
//   and with barycentric coordinates lambda_i x depth.

#include "prt/mesh_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

constexpr int kBandRows = 8;
constexpr int kSliceTriangles = 2048;
constexpr int kMostSamples = 4;
constexpr int kNarrow = 4;  // pixels: triangles up to so wide are looked at without much ado
constexpr std::uint32_t kNothing = 0xffffffffu;

struct Place {
  double x, y;
};
constexpr std::array<Place, 1> kMiddle{{{0.5, 0.5}}};
constexpr std::array<Place, 4> kRotatedGrid{
    {{0.375, 0.125}, {0.875, 0.375}, {0.125, 0.625}, {0.625, 0.875}}};

bool finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check_camera(const Camera& camera) {
  if (camera.width < 1 || camera.height < 1 || camera.width > 16384 || camera.height > 16384) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture size is {}x{}, expected 1x1 to 16384x16384", camera.width,
                            camera.height));
  }
  const auto& rows = camera.orientation.row;
  if (!finite(camera.position) || !finite(rows[0]) || !finite(rows[1]) || !finite(rows[2]) ||
      !(camera.vertical_fov > 0) || !(camera.vertical_fov < kPi)) {
    throw Error(ErrorKind::invalid_argument,
                "the camera holds a number that is not finite or a field of view outside (0, pi)");
  }
}

// A vertex as the camera sees it.
struct Vertex {
  double x = 0, y = 0;    // on the grid, pixels; if not snapped: homogeneous
  double w = 0;           // depth, metres
  double closeness = 0;   // 1 / w, if in front
  bool in_front = false;  // w >= near
  bool snapped = false;
  double px() const { return snapped ? x : x * closeness; }
  double py() const { return snapped ? y : y * closeness; }
  Vec3 homogeneous() const { return snapped ? Vec3{x * w, y * w, w} : Vec3{x, y, w}; }
};

// Pixels, right and bottom past the end.
struct Bounds {
  int left = 0, right = 0, top = 0, bottom = 0;
};

// What is nearest at one place of a pixel so far.
struct Sample {
  double closeness = 0;  // 1 / depth
  std::uint32_t triangle = kNothing;
  float second = 0, third = 0;
};

// A triangle ready to be drawn; edge i lies opposite corner i, > 0 inside.
struct Setup {
  double a[3], b[3], c[3], x0[3], y0[3];  // e = a (px - x0) + b (py - y0) + c
  bool owns_border[3];
  double factor[3];                  // lambda = factor e
  double at_place[3][kMostSamples];  // what each place of a pixel adds to the e of its corner
  double most_at_place[3];
  double most_closeness;
};

}  // namespace

struct MeshPicture::State {
  State(std::shared_ptr<const TransportMesh> mesh, int samples);

  struct Band {
    std::vector<Fragment> fragments;
    std::vector<std::uint32_t> first;  // of each pixel of the band, and the end
  };

  void project(const Camera& camera);
  void sort_into_bands();
  bool bounds(std::uint32_t triangle, Bounds& bounds) const;
  bool set_up(std::uint32_t triangle, Setup& setup) const;
  void draw_band(int band, std::vector<Sample>& samples);
  void look(const Camera& camera);
  void shade(std::span<const Rgb> radiance, Image& picture) const;

  std::shared_ptr<const TransportMesh> mesh_;
  int samples_;
  const Place* place_;  // of the samples in a pixel
  double near_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> band_range_;   // a triangle: first band and one past the last, 16 bits
  std::vector<std::uint32_t> band_counts_;  // [slice of triangles][band]
  std::vector<std::uint32_t> band_first_, band_triangles_;
  std::vector<Band> bands_;
  std::vector<float> coverage_;
  std::vector<double> vertex_sums_;  // scratch of vertex_weights()
  std::mutex mutex_;
  std::vector<std::vector<Sample>> free_samples_;
};

MeshPicture::State::State(std::shared_ptr<const TransportMesh> mesh, int samples)
    : mesh_(std::move(mesh)),
      samples_(samples),
      place_(samples == 1 ? kMiddle.data() : kRotatedGrid.data()) {
  if (samples != 1 && samples != kMostSamples) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} samples a pixel, expected 1 or 4", samples));
  }
  const std::string wrong = mesh_ ? check_mesh(*mesh_) : std::string("there is no mesh to draw");
  if (!wrong.empty()) throw Error(ErrorKind::invalid_argument, wrong);
  near_ = std::max(1e-5 * bounding_sphere(*mesh_).radius, 1e-30);
}

void MeshPicture::State::project(const Camera& camera) {
  const Rotation to_camera = camera.orientation.transposed();
  const Vec3 offset = mesh_->origin - camera.position;
  const double pixels = 0.5 * camera.height / std::tan(0.5 * camera.vertical_fov);
  const double half_width = 0.5 * camera.width, half_height = 0.5 * camera.height;
  // Coordinates of snapped vertices are whole numbers of steps below 2^25, so that products of
  // their differences are exact in double.
  double size = 8;
  while (size < std::max(camera.width, camera.height)) size *= 2;
  const double step = size * 0x1p-23, per_step = 1 / step;
  vertices_.resize(mesh_->position.size());
  const auto count = static_cast<int>(vertices_.size());
  constexpr int kSlice = 4096;
  parallel_for((count + kSlice - 1) / kSlice, [&](int slice) {
    for (int i = slice * kSlice; i < std::min(count, (slice + 1) * kSlice); ++i) {
      const auto& p = mesh_->position[static_cast<std::size_t>(i)];
      const Vec3 q =
          to_camera * (offset + Vec3{static_cast<double>(p[0]), static_cast<double>(p[1]),
                                     static_cast<double>(p[2])});
      Vertex& v = vertices_[static_cast<std::size_t>(i)];
      v.w = -q.z;
      v.x = pixels * q.x + half_width * v.w;
      v.y = half_height * v.w - pixels * q.y;
      v.in_front = v.w >= near_;
      v.snapped = false;
      if (!v.in_front) continue;
      v.closeness = 1 / v.w;
      const double x = v.x * v.closeness, y = v.y * v.closeness;
      if (!(x >= -size && x <= 2 * size && y >= -size && y <= 2 * size)) continue;
      v.x = std::nearbyint(x * per_step) * step;
      v.y = std::nearbyint(y * per_step) * step;
      v.snapped = true;
    }
  });
}

// Which pixels a triangle may touch; false: none.
bool MeshPicture::State::bounds(std::uint32_t triangle, Bounds& bounds) const {
  const auto& corners = mesh_->triangle[triangle];
  const Vertex &a = vertices_[corners[0]], &b = vertices_[corners[1]], &c = vertices_[corners[2]];
  const double width = width_, height = height_;
  if (a.in_front && b.in_front && c.in_front) {
    const double left = std::min({a.px(), b.px(), c.px()});
    const double right = std::max({a.px(), b.px(), c.px()});
    const double top = std::min({a.py(), b.py(), c.py()});
    const double bottom = std::max({a.py(), b.py(), c.py()});
    if (!(right >= 0 && left <= width && bottom >= 0 && top <= height)) return false;
    bounds.left = static_cast<int>(std::max(left, 0.0));
    bounds.right = std::min(width_, static_cast<int>(std::min(right, width)) + 1);
    bounds.top = static_cast<int>(std::max(top, 0.0));
    bounds.bottom = std::min(height_, static_cast<int>(std::min(bottom, height)) + 1);
    return bounds.right > bounds.left && bounds.bottom > bounds.top;
  }
  // Reaches behind the camera: all of the picture, unless all corners are outside on one side.
  const Vec3 h[3] = {a.homogeneous(), b.homogeneous(), c.homogeneous()};
  const auto all = [&](auto outside) { return outside(h[0]) && outside(h[1]) && outside(h[2]); };
  if ((!a.in_front && !b.in_front && !c.in_front) || all([](const Vec3& q) { return q.x < 0; }) ||
      all([&](const Vec3& q) { return q.x > width * q.z; }) ||
      all([](const Vec3& q) { return q.y < 0; }) ||
      all([&](const Vec3& q) { return q.y > height * q.z; })) {
    return false;
  }
  bounds = {0, width_, 0, height_};
  return true;
}

// False for triangles seen edge-on.
bool MeshPicture::State::set_up(std::uint32_t triangle, Setup& s) const {
  const auto& corners = mesh_->triangle[triangle];
  const Vertex* v[3];
  for (std::size_t i = 0; i < 3; ++i) v[i] = &vertices_[corners[i]];

  // Edges. Both triangles of an edge compute it from the lower vertex to the higher, so that theirs
  // are each other's negative bit for bit.
  const bool snapped = v[0]->snapped && v[1]->snapped && v[2]->snapped;
  for (std::size_t i = 0; i < 3; ++i) {
    std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    double sign = 1;
    if (corners[j] > corners[k]) std::swap(j, k), sign = -1;
    const Vertex &p = *v[j], &q = *v[k];
    if (p.snapped && q.snapped) {
      s.a[i] = sign * (p.y - q.y), s.b[i] = sign * (q.x - p.x), s.c[i] = 0;
      s.x0[i] = p.x, s.y0[i] = p.y;
      s.factor[i] = snapped ? v[i]->closeness : p.w * q.w;
    } else {
      const Vec3 e = sign * cross(p.homogeneous(), q.homogeneous());
      s.a[i] = e.x, s.b[i] = e.y, s.c[i] = e.z;
      s.x0[i] = s.y0[i] = 0;
      s.factor[i] = 1;
    }
  }
  double determinant = 0;
  if (snapped) {  // twice the area, exact; the depths are in `factor`
    determinant =
        (v[1]->x - v[0]->x) * (v[2]->y - v[0]->y) - (v[2]->x - v[0]->x) * (v[1]->y - v[0]->y);
  } else {
    determinant = dot(v[0]->homogeneous(), cross(v[1]->homogeneous(), v[2]->homogeneous()));
  }
  if (determinant == 0) return false;
  const double side = determinant > 0 ? 1 : -1, inverse = 1 / std::abs(determinant);
  for (std::size_t i = 0; i < 3; ++i) {
    s.a[i] *= side, s.b[i] *= side, s.c[i] *= side;
    s.factor[i] *= inverse;
    s.owns_border[i] = s.a[i] > 0 || (s.a[i] == 0 && s.b[i] > 0);
    s.most_at_place[i] = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < static_cast<std::size_t>(samples_); ++k) {
      s.at_place[i][k] = s.a[i] * place_[k].x + s.b[i] * place_[k].y;
      s.most_at_place[i] = std::max(s.most_at_place[i], s.at_place[i][k]);
    }
  }
  s.most_closeness = snapped ? std::numeric_limits<double>::infinity() : 1 / near_;
  return true;
}

// Triangle numbers by band, ascending in each.
void MeshPicture::State::sort_into_bands() {
  const auto triangles = static_cast<int>(mesh_->triangle.size());
  const int bands = (height_ + kBandRows - 1) / kBandRows;
  const int slices = (triangles + kSliceTriangles - 1) / kSliceTriangles;
  const auto band_count = static_cast<std::size_t>(bands);
  band_range_.resize(mesh_->triangle.size());
  band_counts_.assign(static_cast<std::size_t>(slices) * band_count, 0);
  const auto for_slice = [&](int slice, const auto& body) {
    const int end = std::min(triangles, (slice + 1) * kSliceTriangles);
    for (int t = slice * kSliceTriangles; t < end; ++t) body(static_cast<std::uint32_t>(t));
  };
  parallel_for(slices, [&](int slice) {
    std::uint32_t* counts = band_counts_.data() + static_cast<std::size_t>(slice) * band_count;
    for_slice(slice, [&](std::uint32_t t) {
      Bounds s;
      band_range_[t] = 0;
      if (!bounds(t, s)) return;
      const auto first = static_cast<std::uint32_t>(s.top / kBandRows);
      const auto end = static_cast<std::uint32_t>((s.bottom + kBandRows - 1) / kBandRows);
      band_range_[t] = first << 16 | end;
      for (std::uint32_t b = first; b < end; ++b) ++counts[b];
    });
  });
  // Counts become places.
  band_first_.resize(band_count + 1);
  std::uint32_t place = 0;
  for (std::size_t b = 0; b < band_count; ++b) {
    band_first_[b] = place;
    for (std::size_t slice = 0; slice < static_cast<std::size_t>(slices); ++slice) {
      place += std::exchange(band_counts_[slice * band_count + b], place);
    }
  }
  band_first_[band_count] = place;
  band_triangles_.resize(place);
  parallel_for(slices, [&](int slice) {
    std::uint32_t* next = band_counts_.data() + static_cast<std::size_t>(slice) * band_count;
    for_slice(slice, [&](std::uint32_t t) {
      const std::uint32_t first = band_range_[t] >> 16, end = band_range_[t] & 0xffffu;
      for (std::uint32_t b = first; b < end; ++b) band_triangles_[next[b]++] = t;
    });
  });
}

void MeshPicture::State::draw_band(int band, std::vector<Sample>& samples) {
  const int first_row = band * kBandRows, end_row = std::min(height_, first_row + kBandRows);
  const auto n = static_cast<std::size_t>(samples_);
  const auto row_samples = static_cast<std::size_t>(width_) * n;
  samples.assign(row_samples * static_cast<std::size_t>(end_row - first_row), Sample{});

  const auto at = static_cast<std::size_t>(band);
  for (std::uint32_t i = band_first_[at]; i < band_first_[at + 1]; ++i) {
    const std::uint32_t triangle = band_triangles_[i];
    Setup s;
    Bounds box;
    if (!bounds(triangle, box) || !set_up(triangle, s)) continue;
    const bool wide = box.right - box.left > kNarrow;
    double along[3];  // how far along a row an edge goes with one unit of e
    for (std::size_t j = 0; wide && j < 3; ++j) along[j] = -1 / s.a[j];
    for (int y = std::max(box.top, first_row); y < std::min(box.bottom, end_row); ++y) {
      double row_e[3];
      for (std::size_t j = 0; j < 3; ++j) row_e[j] = s.b[j] * (y - s.y0[j]) + s.c[j];
      Sample* row = samples.data() + static_cast<std::size_t>(y - first_row) * row_samples;
      int left = box.left, right = box.right;
      if (wide) {
        // Only where the row is inside of all edges, give or take a pixel for rounding.
        double from = left, to = right;
        for (std::size_t j = 0; j < 3; ++j) {
          const double border = s.x0[j] + (row_e[j] + s.most_at_place[j]) * along[j];
          if (s.a[j] > 0 && border - 1 > from) from = border - 1;
          if (s.a[j] < 0 && border + 2 < to) to = border + 2;
        }
        if (!(from < to)) continue;
        left = static_cast<int>(from), right = static_cast<int>(to);
      }
      for (int x = left; x < right; ++x) {
        double corner[3];
        for (std::size_t j = 0; j < 3; ++j) corner[j] = s.a[j] * (x - s.x0[j]) + row_e[j];
        if (corner[0] + s.most_at_place[0] < 0 || corner[1] + s.most_at_place[1] < 0 ||
            corner[2] + s.most_at_place[2] < 0) {
          continue;
        }
        for (std::size_t k = 0; k < n; ++k) {
          double e[3];
          for (std::size_t j = 0; j < 3; ++j) e[j] = corner[j] + s.at_place[j][k];
          if (e[0] < 0 || e[1] < 0 || e[2] < 0) continue;
          if ((e[0] == 0 && !s.owns_border[0]) || (e[1] == 0 && !s.owns_border[1]) ||
              (e[2] == 0 && !s.owns_border[2])) {
            continue;
          }
          const double second = s.factor[1] * e[1], third = s.factor[2] * e[2];
          const double closeness = s.factor[0] * e[0] + second + third;
          Sample& sample = row[static_cast<std::size_t>(x) * n + k];
          if (!(closeness > sample.closeness) || closeness > s.most_closeness) continue;
          const double depth = 1 / closeness;
          sample = {closeness, triangle, static_cast<float>(second * depth),
                    static_cast<float>(third * depth)};
        }
      }
    }
  }

  // Samples of a pixel on one triangle become one fragment.
  Band& out = bands_[at];
  out.fragments.clear();
  out.first.clear();
  const float share = 1.0f / static_cast<float>(samples_);
  for (std::size_t pixel = 0; pixel < samples.size() / n; ++pixel) {
    const std::size_t begin = out.fragments.size();
    out.first.push_back(static_cast<std::uint32_t>(begin));
    float covered = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const Sample& sample = samples[pixel * n + k];
      if (sample.triangle == kNothing) continue;
      covered += share;
      std::size_t f = begin;
      while (f < out.fragments.size() && out.fragments[f].triangle != sample.triangle) ++f;
      if (f == out.fragments.size()) out.fragments.push_back({sample.triangle, 0, 0, 0});
      out.fragments[f].share += share;
      out.fragments[f].second += share * sample.second;
      out.fragments[f].third += share * sample.third;
    }
    coverage_[static_cast<std::size_t>(first_row) * static_cast<std::size_t>(width_) + pixel] =
        covered;
  }
  out.first.push_back(static_cast<std::uint32_t>(out.fragments.size()));
}

void MeshPicture::State::look(const Camera& camera) {
  check_camera(camera);
  width_ = camera.width, height_ = camera.height;
  project(camera);
  sort_into_bands();
  const int bands = (height_ + kBandRows - 1) / kBandRows;
  bands_.resize(static_cast<std::size_t>(bands));
  coverage_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  parallel_for(bands, [&](int band) {
    std::vector<Sample> samples;  // handed from band to band, at most one a thread
    {
      const std::lock_guard lock(mutex_);
      if (!free_samples_.empty()) {
        samples = std::move(free_samples_.back());
        free_samples_.pop_back();
      }
    }
    draw_band(band, samples);
    const std::lock_guard lock(mutex_);
    free_samples_.push_back(std::move(samples));
  });
}

void MeshPicture::State::shade(std::span<const Rgb> radiance, Image& picture) const {
  if (radiance.size() != mesh_->position.size()) {
    throw Error(ErrorKind::invalid_argument, fmt::format("{} radiances, expected {}, one a vertex",
                                                         radiance.size(), mesh_->position.size()));
  }
  if (picture.width != width_ || picture.height != height_) picture = Image(width_, height_);
  parallel_for(static_cast<int>(bands_.size()), [&](int i) {
    const Band& band = bands_[static_cast<std::size_t>(i)];
    Rgb* pixel = picture.pixels.data() +
                 static_cast<std::size_t>(i) * kBandRows * static_cast<std::size_t>(width_);
    for (std::size_t p = 0; p + 1 < band.first.size(); ++p) {
      Rgb sum;
      for (std::uint32_t f = band.first[p]; f < band.first[p + 1]; ++f) {
        const Fragment& fragment = band.fragments[f];
        const auto& corner = mesh_->triangle[fragment.triangle];
        const Rgb &r0 = radiance[corner[0]], &r1 = radiance[corner[1]], &r2 = radiance[corner[2]];
        sum += fragment.share * r0 + fragment.second * (r1 - r0) + fragment.third * (r2 - r0);
      }
      pixel[p] = sum;
    }
  });
}

MeshPicture::MeshPicture(std::shared_ptr<const TransportMesh> mesh, int samples)
    : state_(std::make_unique<State>(std::move(mesh), samples)) {}
MeshPicture::~MeshPicture() = default;
MeshPicture::MeshPicture(MeshPicture&&) noexcept = default;
MeshPicture& MeshPicture::operator=(MeshPicture&&) noexcept = default;

void MeshPicture::look(const Camera& camera) { state_->look(camera); }

void MeshPicture::shade(std::span<const Rgb> radiance, Image& picture) const {
  state_->shade(radiance, picture);
}

std::span<const float> MeshPicture::coverage() const { return state_->coverage_; }

std::span<const MeshPicture::Fragment> MeshPicture::fragments(int x, int y) const {
  const State::Band& band = state_->bands_[static_cast<std::size_t>(y / kBandRows)];
  const std::size_t pixel =
      static_cast<std::size_t>(y % kBandRows) * static_cast<std::size_t>(state_->width_) +
      static_cast<std::size_t>(x);
  return std::span(band.fragments)
      .subspan(band.first[pixel], band.first[pixel + 1] - band.first[pixel]);
}

void MeshPicture::vertex_weights(std::vector<float>& weights) const {
  const State& s = *state_;
  // In double: a vertex of a coarse mesh is seen by many thousand pixels.
  std::vector<double>& sums = state_->vertex_sums_;
  sums.assign(s.mesh_->position.size(), 0.0);
  for (int y = 0; y < s.height_; ++y) {
    for (int x = 0; x < s.width_; ++x) {
      const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width_) +
                         static_cast<std::size_t>(x);
      const auto covered = static_cast<double>(s.coverage_[pixel]);
      for (const Fragment& f : fragments(x, y)) {
        const auto& corner = s.mesh_->triangle[f.triangle];
        const auto second = static_cast<double>(f.second), third = static_cast<double>(f.third);
        sums[corner[0]] += covered * (static_cast<double>(f.share) - second - third);
        sums[corner[1]] += covered * second;
        sums[corner[2]] += covered * third;
      }
    }
  }
  weights.resize(sums.size());
  std::transform(sums.begin(), sums.end(), weights.begin(),
                 [](double sum) { return static_cast<float>(sum); });
}

}  // namespace haarlight
