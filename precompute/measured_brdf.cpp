// Measured isotropic BRDFs as tables, in the binary form of the MERL database.

#include "precompute/measured_brdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/error.h"
#include "core/vec.h"

namespace haarlight {
namespace {

// The cell below `at` (in cells, middles at halves), the next, and the share of that.
struct Between {
  std::size_t low, high;
  double share;
};
Between between_cells(double at, int cells) {
  const double place = std::clamp(at - 0.5, 0.0, static_cast<double>(cells - 1));
  const auto low = std::min(static_cast<std::size_t>(place), static_cast<std::size_t>(cells - 1));
  return {low, std::min(low + 1, static_cast<std::size_t>(cells - 1)),
          place - static_cast<double>(low)};
}

std::vector<char> bytes_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    throw Error(ErrorKind::missing, fmt::format("{}: no such file", file.string()));
  }
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  const std::streamoff size = in ? static_cast<std::streamoff>(in.tellg()) : -1;
  constexpr std::streamoff kMost = std::streamoff{1} << 32;
  if (size < 0 || size > kMost || !std::filesystem::is_regular_file(file, error)) {
    throw Error(ErrorKind::io, fmt::format("{}: cannot be read", file.string()));
  }
  std::vector<char> bytes(static_cast<std::size_t>(size));
  in.seekg(0);
  if (size > 0 && !in.read(bytes.data(), size)) {
    throw Error(ErrorKind::io, fmt::format("{}: cannot be read", file.string()));
  }
  return bytes;
}

// Mean over the hemisphere (projected) of what is reflected, by midpoints.
RgbD mean_albedo(const MeasuredBrdf& brdf) {
  constexpr int kAngles = 32, kTurns = 64;
  RgbD sum;
  double weight = 0;
  for (int o = 0; o < kAngles; ++o) {
    const double cosine_o = std::sqrt((o + 0.5) / kAngles);  // even in projected solid angle
    for (int i = 0; i < kAngles; ++i) {
      const double cosine_i = std::sqrt((i + 0.5) / kAngles);
      for (int p = 0; p < kTurns; ++p) {
        sum += brdf.between(cosine_i, cosine_o, kPi * (p + 0.5) / kTurns);
        weight += 1;
      }
    }
  }
  sum *= kPi / weight;
  return {std::clamp(sum.r, 0.0, 1.0), std::clamp(sum.g, 0.0, 1.0), std::clamp(sum.b, 0.0, 1.0)};
}

// Where the mean over theta_d of the lobe has fallen half way to what it is at 45 degrees.
double lobe_half_width(const MeasuredBrdf& brdf) {
  const auto at = [&](double theta_half) {
    double sum = 0;
    for (int d = 0; d < 16; ++d) sum += luminance(brdf.at(theta_half, d * kPi / 64, kPi / 2));
    return sum;
  };
  const double base = at(kPi / 4), half = 0.5 * (at(0) + base);
  if (!(at(0) > 1.1 * base)) return kPi / 4;
  double theta = 0;
  while (theta < kPi / 4 && at(theta) > half) theta += 0.001;
  return std::max(2 * theta, 0.002);
}

}  // namespace

RgbD MeasuredBrdf::at(double theta_half, double theta_difference, double phi_difference) const {
  const double half_share = std::sqrt(std::clamp(theta_half * 2 / kPi, 0.0, 1.0));
  const Between h = between_cells(half_share * half_cells, half_cells);
  const Between d = between_cells(theta_difference * 2 / kPi * difference_cells, difference_cells);
  double turn = std::fmod(phi_difference, kPi);
  if (turn < 0) turn += kPi;
  // Around: the last cell is the first one's neighbour.
  const double place = turn / kPi * azimuth_cells - 0.5;
  const double floor = std::floor(place);
  const auto wrap = [&](double cell) {
    const int c = static_cast<int>(cell) % azimuth_cells;
    return static_cast<std::size_t>(c < 0 ? c + azimuth_cells : c);
  };
  const Between a{wrap(floor), wrap(floor + 1), place - floor};
  const auto line = [&](std::size_t half, std::size_t difference) {
    const Rgb* row =
        value.data() + (half * static_cast<std::size_t>(difference_cells) + difference) *
                           static_cast<std::size_t>(azimuth_cells);
    return RgbD(row[a.low]) * (1 - a.share) + RgbD(row[a.high]) * a.share;
  };
  const RgbD near = line(h.low, d.low) * (1 - d.share) + line(h.low, d.high) * d.share;
  const RgbD far = line(h.high, d.low) * (1 - d.share) + line(h.high, d.high) * d.share;
  return near * (1 - h.share) + far * h.share;
}

RgbD MeasuredBrdf::between(double cosine_i, double cosine_o, double phi) const {
  if (!(cosine_i > 0) || !(cosine_o > 0)) return {};
  const double sine_i = std::sqrt(std::max(0.0, 1 - cosine_i * cosine_i));
  const double sine_o = std::sqrt(std::max(0.0, 1 - cosine_o * cosine_o));
  const Vec3 in{sine_i, 0, cosine_i};
  const Vec3 out{sine_o * std::cos(phi), sine_o * std::sin(phi), cosine_o};
  const Vec3 h = normalize(in + out);
  const double across = std::hypot(h.x, h.y);
  const double theta_half = std::atan2(across, h.z);
  // `in` with the half vector turned onto the normal: about it, then about y.
  const double c = across > 1e-12 ? h.x / across : 1, s = across > 1e-12 ? h.y / across : 0;
  const Vec3 turned{c * in.x + s * in.y, c * in.y - s * in.x, in.z};
  const Vec3 difference{h.z * turned.x - across * turned.z, turned.y,
                        across * turned.x + h.z * turned.z};
  const double theta_difference = std::atan2(std::hypot(difference.x, difference.y), difference.z);
  return at(theta_half, theta_difference, std::atan2(difference.y, difference.x));
}

MeasuredBrdf read_merl(const std::filesystem::path& file) {
  const std::vector<char> bytes = bytes_of(file);
  std::array<std::int32_t, 3> count{};
  const auto refuse = [&](const std::string& why) {
    return Error(
        ErrorKind::format,
        fmt::format("{}: {}, expected a BRDF table in MERL's binary form", file.string(), why));
  };
  if (bytes.size() < sizeof count) throw refuse(fmt::format("{} bytes", bytes.size()));
  std::memcpy(count.data(), bytes.data(), sizeof count);
  for (const std::int32_t n : count) {
    if (n < 1 || n > kMostMerlCells) {
      throw refuse(fmt::format("begins with {} x {} x {} cells", count[0], count[1], count[2]));
    }
  }
  const auto size = [&](std::size_t i) { return static_cast<std::size_t>(count[i]); };
  const std::size_t cells = size(0) * size(1) * size(2);
  const std::size_t wanted = sizeof count + 3 * sizeof(double) * cells;
  if (bytes.size() != wanted) {
    throw refuse(fmt::format("{} bytes do not fit {} x {} x {} cells, which take {}", bytes.size(),
                             count[0], count[1], count[2], wanted));
  }
  MeasuredBrdf brdf;
  brdf.half_cells = count[0], brdf.difference_cells = count[1], brdf.azimuth_cells = count[2];
  brdf.value.resize(cells);
  const auto entry = [&](std::size_t channel, std::size_t cell) {
    double value = 0;
    std::memcpy(&value, bytes.data() + sizeof count + sizeof value * (channel * cells + cell),
                sizeof value);
    value *= kMerlScale[channel];
    if (value >= 0 && value <= 1e30) return static_cast<float>(value);
    ++brdf.negative;
    return 0.0f;
  };
  for (std::size_t i = 0; i < cells; ++i) brdf.value[i] = {entry(0, i), entry(1, i), entry(2, i)};
  // A surface does not tell left from right.
  for (std::size_t row = 0; row < cells; row += size(2)) {
    for (std::size_t a = 0; a < size(2) / 2; ++a) {
      Rgb &left = brdf.value[row + a], &right = brdf.value[row + size(2) - 1 - a];
      left = right = 0.5f * (left + right);
    }
  }
  brdf.albedo = mean_albedo(brdf);
  brdf.half_width = lobe_half_width(brdf);
  return brdf;
}

}  // namespace haarlight
