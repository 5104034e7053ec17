// Associated Legendre functions by their stable recurrences, normalised as they go.

#include "prt/spherical_harmonics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/parallel.h"
#include "wavelet/cubemap.h"

namespace haarlight {

int sh_degree(int function) {
  int l = 0;
  while ((l + 1) * (l + 1) <= function) ++l;
  return l;
}

// With z the cosine from the pole, s its sine, P_l^m normalised so that P_l^m cos(m phi) sqrt(2) is
// orthonormal:
//   P_m^m = sqrt((2m + 1) / (2m)) s P_(m-1)^(m-1),   P_(m+1)^m = sqrt(2m + 3) z P_m^m,
//   P_l^m = a (z P_(l-1)^m - b P_(l-2)^m),
//   a = sqrt((4 l^2 - 1) / (l^2 - m^2)),  b = sqrt(((l - 1)^2 - m^2) / (4 (l - 1)^2 - 1)).
void spherical_harmonics(int order, const Vec3& direction, std::span<double> values) {
  const double z = direction.y, s = std::hypot(direction.x, direction.z);
  const double cos1 = s > 0 ? direction.z / s : 1, sin1 = s > 0 ? direction.x / s : 0;
  double diagonal = std::sqrt(1 / (4 * kPi)), cos_m = 1, sin_m = 0;
  for (int m = 0; m < order; ++m) {
    if (m > 0) {
      diagonal *= std::sqrt((2.0 * m + 1) / (2.0 * m)) * s;
      const double next = cos_m * cos1 - sin_m * sin1;
      sin_m = sin_m * cos1 + cos_m * sin1;
      cos_m = next;
    }
    double before = 0, now = diagonal;
    for (int l = m; l < order; ++l) {
      if (l > m) {
        const double ll = static_cast<double>(l) * l, mm = static_cast<double>(m) * m;
        const double k = (l - 1.0) * (l - 1.0);
        const double a = std::sqrt((4 * ll - 1) / (ll - mm));
        const double b = l - 1 > m ? std::sqrt((k - mm) / (4 * k - 1)) : 0;
        const double next = a * (z * now - b * before);
        before = now;
        now = next;
      }
      const auto middle = static_cast<std::size_t>(l * l + l);
      if (m == 0) {
        values[middle] = now;
      } else {
        values[middle + static_cast<std::size_t>(m)] = std::sqrt(2.0) * now * cos_m;
        values[middle - static_cast<std::size_t>(m)] = std::sqrt(2.0) * now * sin_m;
      }
    }
  }
}

ShProjection::ShProjection(const HaarLayout& layout, int order)
    : order_(order), size_(static_cast<std::size_t>(layout.size())) {
  if (order < 1 || order > kMaxShOrder) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("order of spherical harmonics is {}, expected 1 to {}", order, kMaxShOrder));
  }
  const auto count = static_cast<std::size_t>(sh_count(order));
  const int n = layout.face_size();
  const std::vector<double> solid = cube_solid_angles(n);
  std::vector<double> value(count * size_), weighted(count * size_);
  std::vector<double> at(count);
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const std::size_t texel = cube_index(face, x, y, n);
        spherical_harmonics(order, cube_texel_center(face, x, y, n), at);
        for (std::size_t k = 0; k < count; ++k) {
          value[k * size_ + texel] = at[k];
          weighted[k * size_ + texel] = at[k] * solid[cube_index(0, x, y, n)];
        }
      }
    }
  }
  haar_.resize(count * size_);
  haar_solid_.resize(count * size_);
  std::vector<double> transformed(size_);
  for (std::size_t k = 0; k < count; ++k) {
    const auto store = [&](const std::vector<double>& from, std::vector<float>& to) {
      haar_forward(layout, std::span<const double>(from).subspan(k * size_, size_),
                   std::span<double>(transformed));
      std::transform(transformed.begin(), transformed.end(),
                     to.begin() + static_cast<std::ptrdiff_t>(k * size_),
                     [](double v) { return static_cast<float>(v); });
    };
    store(value, haar_);
    store(weighted, haar_solid_);
  }
}

std::span<const float> ShProjection::haar(int function) const {
  return std::span(haar_).subspan(static_cast<std::size_t>(function) * size_, size_);
}

void ShProjection::project(std::span<const Rgb> lighting, std::span<RgbD> out) const {
  parallel_for(sh_count(order_), [&](int function) {
    const auto k = static_cast<std::size_t>(function);
    const float* y = haar_solid_.data() + k * size_;
    RgbD sum;
    for (std::size_t j = 0; j < size_; ++j) sum += static_cast<double>(y[j]) * RgbD(lighting[j]);
    out[k] = sum;
  });
}

}  // namespace haarlight
