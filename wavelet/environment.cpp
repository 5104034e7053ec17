// Distant light: the gate every environment passes, and looking one up by direction.

#include "wavelet/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/image_io.h"

namespace haarlight {
namespace {

/// Beyond this a square leaves float's range, and so would errors and norms.
constexpr double kLargestRadiance = 1.8e18;

Projection choose_projection(const Image& picture, const EnvironmentOptions& options,
                             const std::string& name) {
  if (picture.width < 1 || picture.height < 1 ||
      picture.pixels.size() !=
          static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: is {}x{} with {} pixels, expected width x height, not zero", name,
                            picture.width, picture.height, picture.pixels.size()));
  }
  const std::optional<Projection> by_shape = projection_of_shape(picture.width, picture.height);
  if (!options.projection) {
    if (by_shape) return *by_shape;
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: is {}x{}, expected 2:1 (latlong), 1:1 (angular) or 3:4 "
                            "(vertical-cross)",
                            name, picture.width, picture.height));
  }
  // A lat-long picture of another shape still says what each pixel is; the others would be bent.
  const Projection wanted = *options.projection;
  if (wanted != Projection::latlong && by_shape != wanted) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: is {}x{}, expected {} for the {} projection", name, picture.width,
                            picture.height, wanted == Projection::angular ? "1:1" : "3:4",
                            projection_name(wanted)));
  }
  return wanted;
}

/// Two neighbouring pixels of an axis and how much of the second; wrapped or clamped to
/// [first, first + count).
struct AxisBlend {
  int low, high;
  float share;
};
AxisBlend blend_axis(double position, int first, int count, bool wrap) {
  const double floor = std::floor(position - 0.5);
  const auto share = static_cast<float>(position - 0.5 - floor);
  const int low = static_cast<int>(floor) - first;
  const auto bring_in = [&](int i) {
    return first + (wrap ? (i % count + count) % count : std::clamp(i, 0, count - 1));
  };
  return {bring_in(low), bring_in(low + 1), share};
}

}  // namespace

Environment::Environment(Image picture, const EnvironmentOptions& options, const std::string& name)
    : picture_(std::move(picture)), projection_(choose_projection(picture_, options, name)) {
  if (!std::isfinite(options.scale) || options.scale <= 0) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("{}: scale is {}, expected a finite number above 0", name, options.scale));
  }
  for (std::size_t i = 0; i < picture_.pixels.size(); ++i) {
    Rgb& pixel = picture_.pixels[i];
    if (!is_finite(pixel)) {
      ++report_.not_finite_pixels;
      pixel = {};
      continue;
    }
    const RgbD scaled = RgbD(pixel) * options.scale;
    const double smallest = std::min({scaled.r, scaled.g, scaled.b});
    if (smallest < 0) {
      ++report_.negative_pixels;
      report_.smallest = std::min(report_.smallest, smallest);
    }
    const double largest = std::max({scaled.r, scaled.g, scaled.b});
    if (largest > kLargestRadiance) {
      const auto width = static_cast<std::size_t>(picture_.width);
      throw Error(ErrorKind::format,
                  fmt::format("{}: radiance is {:g} at pixel ({}, {}), expected at most {:g}", name,
                              largest, i % width, i / width, kLargestRadiance));
    }
    pixel = Rgb(RgbD(std::max(scaled.r, 0.0), std::max(scaled.g, 0.0), std::max(scaled.b, 0.0)));
  }
  const auto pixels = static_cast<std::int64_t>(picture_.pixels.size());
  if (report_.not_finite_pixels > pixels / 1000) {
    throw Error(ErrorKind::format,
                fmt::format("{}: {} of {} pixels are not finite, expected at most {}", name,
                            report_.not_finite_pixels, pixels, pixels / 1000));
  }
}

Rgb Environment::radiance(const Vec3& along) const {
  const double size = std::max({std::abs(along.x), std::abs(along.y), std::abs(along.z)});
  if (!(size > 0) || !std::isfinite(along.x) || !std::isfinite(along.y) ||
      !std::isfinite(along.z)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("direction is ({}, {}, {}), expected finite numbers, not all 0",
                            along.x, along.y, along.z));
  }
  // Squares of very long and very short ones are beyond what doubles hold.
  const int power = size > 1e100 || size < 1e-100 ? -std::ilogb(size) : 0;
  const Vec3 direction = power == 0 ? along
                                    : Vec3{std::scalbn(along.x, power), std::scalbn(along.y, power),
                                           std::scalbn(along.z, power)};
  const PicturePoint point = projection_point(projection_, direction);
  const double x = point.u * picture_.width, y = point.v * picture_.height;

  // Neighbours must be neighbours on the sphere too: a cross is only joined inside a face.
  int first_x = 0, first_y = 0, count_x = picture_.width, count_y = picture_.height;
  if (projection_ == Projection::vertical_cross) {
    constexpr std::array<int, 6> kColumn = {2, 0, 1, 1, 1, 1}, kRow = {1, 1, 0, 2, 3, 1};
    const auto face = static_cast<std::size_t>(cube_point(direction).face);
    count_x /= 3;
    count_y /= 4;
    first_x = kColumn[face] * count_x;
    first_y = kRow[face] * count_y;
  }
  const AxisBlend bx = blend_axis(x, first_x, count_x, projection_ == Projection::latlong);
  const AxisBlend by = blend_axis(y, first_y, count_y, false);

  Rgb sum;
  float total = 0;
  const auto add = [&](int px, int py, float weight) {
    // Pixels centred outside the disc of an angular map carry nothing.
    if (projection_ == Projection::angular &&
        std::hypot(2 * (px + 0.5) / picture_.width - 1, 2 * (py + 0.5) / picture_.height - 1) > 1) {
      return;
    }
    sum += weight * picture_.at(px, py);
    total += weight;
  };
  add(bx.low, by.low, (1 - bx.share) * (1 - by.share));
  add(bx.high, by.low, bx.share * (1 - by.share));
  add(bx.low, by.high, (1 - bx.share) * by.share);
  add(bx.high, by.high, bx.share * by.share);
  if (total > 0) return sum * (1 / total);
  // Only a corner of a pixel outside the disc can come here: the nearest pixel towards the middle.
  const auto towards_middle = [](double position, int count) {
    const double middle = 0.5 * count, step = middle - position;
    return std::clamp(static_cast<int>(position + (step > 0 ? 1 : -1)), 0, count - 1);
  };
  return picture_.at(towards_middle(x, count_x), towards_middle(y, count_y));
}

Environment load_environment(const std::filesystem::path& file, const EnvironmentOptions& options) {
  return Environment(load_image(file), options, file.string());
}

}  // namespace haarlight
