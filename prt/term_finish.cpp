// Sums of (vertex, term) rows and a view become the radiance of vertices.

#include "prt/term_finish.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/simd.h"

namespace haarlight {
namespace {

constexpr std::size_t kSlice = 512;  // vertices a thread takes at a time; tables fit its cache

// Of the vertices of a slice: t = sqrt(1 - cos theta), cos phi, sin phi of the direction to the
// eye.
struct Directions {
  float t[kSlice], x[kSlice], y[kSlice];
};

// Half the squared chord between direction and normal is 1 - cos theta without its cancellation.
HAARLIGHT_MULTIVERSION
void directions_of(const float (*position)[3], const float (*normal)[3], std::size_t count,
                   const float* eye, Directions& out) {
  for (std::size_t i = 0; i < count; ++i) {
    const float nx = normal[i][0], ny = normal[i][1], nz = normal[i][2];
    // Quarters, so that no difference of finite numbers overflows; brought to the size of 1, so
    // that no square does.
    float x = 0.25f * eye[0] - 0.25f * position[i][0];
    float y = 0.25f * eye[1] - 0.25f * position[i][1];
    float z = 0.25f * eye[2] - 0.25f * position[i][2];
    const float most = std::max(std::max(std::abs(x), std::abs(y)), std::abs(z));
    const float unit = 1 / std::max(most, 1e-30f);
    x *= unit, y *= unit, z *= unit;
    const float scale = 1 / std::sqrt(std::max(x * x + y * y + z * z, 1e-30f));
    x *= scale, y *= scale, z *= scale;
    const float cx = x - nx, cy = y - ny, cz = z - nz;
    out.t[i] = std::sqrt(std::min(0.5f * (cx * cx + cy * cy + cz * cz), 1.0f));
    // Frame(normal), core/frame.h.
    const float sign = std::copysign(1.0f, nz), a = -1 / (sign + nz), b = nx * ny * a;
    const float lx = (1 + sign * nx * nx * a) * x + sign * b * y - sign * nx * z;
    const float ly = b * x + (sign + ny * ny * a) * y - ny * z;
    const float across = lx * lx + ly * ly;
    const float inverse = 1 / std::sqrt(std::max(across, 1e-30f));
    out.x[i] = across > 1e-30f ? lx * inverse : 1.0f;
    out.y[i] = across > 1e-30f ? ly * inverse : 0.0f;
  }
}

}  // namespace

TermFinish::TermFinish(std::shared_ptr<const TransportMesh> mesh,
                       std::shared_ptr<const ViewFactors> factors)
    : mesh_(std::move(mesh)), view_(std::move(factors)) {
  if (!mesh_ || !view_) {
    throw Error(ErrorKind::invalid_argument, "view factors want a mesh that they are of");
  }
  std::string wrong = check_mesh(*mesh_);
  if (wrong.empty()) wrong = check_view_factors(*view_, mesh_->position.size());
  if (!wrong.empty()) throw Error(ErrorKind::invalid_argument, wrong);

  const auto terms = static_cast<std::size_t>(view_->terms);
  for (std::size_t s = 0; s < view_->sets(); ++s) {
    Set& set = set_.emplace_back();
    for (std::size_t k = 0; k < terms; ++k) {
      const std::span<const Rgb> profile = view_->profile_of(s, k);
      for (const Rgb& p : profile) profile_.push_back({{p.r, p.g, p.b, 0}});
      // Dark terms before the last that is not are looked at, too: their orders count.
      set.most_order = std::max(set.most_order, std::abs(view_->order[s * terms + k]));
      if (std::all_of(profile.begin(), profile.end(), [](const Rgb& p) { return p == Rgb{}; })) {
        continue;
      }
      set.terms = static_cast<std::uint32_t>(k + 1);
    }
  }
  for (const auto& n : mesh_->normal) {
    const Vec3 wide{static_cast<double>(n[0]), static_cast<double>(n[1]),
                    static_cast<double>(n[2])};
    const double size = length(wide);
    const Vec3 unit = size > 0 ? wide * (1 / size) : Vec3{0, 0, 1};
    normal_.push_back(
        {static_cast<float>(unit.x), static_cast<float>(unit.y), static_cast<float>(unit.z)});
  }
  factor_.resize(mesh_->position.size() * terms);
}

void TermFinish::look_slice(std::size_t begin, std::size_t end, const float* eye) {
  Directions to_eye;
  directions_of(reinterpret_cast<const float(*)[3]>(mesh_->position.data() + begin),
                reinterpret_cast<const float(*)[3]>(normal_.data() + begin), end - begin, eye,
                to_eye);
  typedef float Lanes __attribute__((vector_size(16), aligned(4)));
  const auto terms = static_cast<std::size_t>(view_->terms);
  const auto samples = static_cast<std::size_t>(view_->resolution);
  // cos(m phi), sin(m phi) by turning on.
  float cosine[kMostViewOrder + 1], sine[kMostViewOrder + 1];
  cosine[0] = 1, sine[0] = 0;
  for (std::size_t v = begin; v < end; ++v) {
    const std::size_t i = v - begin;
    const std::uint32_t s = view_->set_of[v];
    const Set& set = set_[s];
    const float c = to_eye.x[i], d = to_eye.y[i];
    for (int m = 1; m <= set.most_order; ++m) {
      cosine[m] = cosine[m - 1] * c - sine[m - 1] * d;
      sine[m] = sine[m - 1] * c + cosine[m - 1] * d;
    }
    const float at = to_eye.t[i] * static_cast<float>(samples - 1);
    const std::size_t sample = std::min(static_cast<std::size_t>(at), samples - 2);
    const float share = at - static_cast<float>(sample);
    const Four* profile = profile_.data() + s * terms * samples + sample;
    const int* order = view_->order.data() + s * terms;
    Rgb* g = factor_.data() + v * terms;
    for (std::uint32_t k = 0; k < set.terms; ++k, profile += samples) {
      const Lanes low = *reinterpret_cast<const Lanes*>(profile[0].value);
      const Lanes high = *reinterpret_cast<const Lanes*>(profile[1].value);
      const int m = order[k];
      const Lanes value = (low + share * (high - low)) * (m >= 0 ? cosine[m] : sine[-m]);
      g[k] = {value[0], value[1], value[2]};
    }
  }
}

void TermFinish::look(const Vec3& eye) {
  const Vec3 from_origin = eye - mesh_->origin;
  const auto within = [](double x) { return static_cast<float>(std::clamp(x, -3e38, 3e38)); };
  const float local[3] = {within(from_origin.x), within(from_origin.y), within(from_origin.z)};
  const std::size_t vertices = normal_.size();
  parallel_for(static_cast<int>((vertices + kSlice - 1) / kSlice), [&](int slice) {
    const std::size_t begin = static_cast<std::size_t>(slice) * kSlice;
    look_slice(begin, std::min(begin + kSlice, vertices), local);
  });
}

void TermFinish::shade(std::span<const Rgb> sums, std::span<Rgb> radiance) const {
  const auto terms = static_cast<std::size_t>(view_->terms);
  const std::size_t vertices = normal_.size();
  if (sums.size() != vertices * terms || radiance.size() != vertices) {
    throw Error(ErrorKind::invalid_argument,
                "sums or radiance are not those of the mesh and its terms");
  }
  parallel_for(static_cast<int>((vertices + kSlice - 1) / kSlice), [&](int slice) {
    const std::size_t begin = static_cast<std::size_t>(slice) * kSlice;
    for (std::size_t v = begin; v < std::min(begin + kSlice, vertices); ++v) {
      const Rgb* u = sums.data() + v * terms;
      const Rgb* g = factor_.data() + v * terms;
      Rgb sum;
      for (std::uint32_t k = 0; k < set_[view_->set_of[v]].terms; ++k) sum += g[k] * u[k];
      radiance[v] = sum;
    }
  });
}

}  // namespace haarlight
