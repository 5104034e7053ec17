// The list of environments, and how a model becomes a picture.

#include "data_gen/environments.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/parallel.h"

namespace haarlight::data_gen {
namespace {

constexpr std::array kEnvironments{
    EnvironmentEntry{"gallery", "an interior with small very bright lamps, windows and dark walls",
                     make_gallery},
    EnvironmentEntry{"sky", "a clear sky with the sun's disc", make_sky},
    EnvironmentEntry{"clouds", "a cloudy sky", make_clouds},
    EnvironmentEntry{"labels", "the six axes, coloured and named: shows a wrong turn at once",
                     make_labels},
};

bool covers(const DiscLight& disc, const Vec3& direction) {
  // Chord instead of cosine: 1 - cos loses all its digits for a disc of a fraction of a degree.
  const Vec3 chord = direction - disc.direction;
  const double reach = 2 * std::sin(0.5 * disc.half_angle);
  return dot(chord, chord) < reach * reach;
}

RgbD disc_light(std::span<const DiscLight> discs, const Vec3& direction) {
  RgbD sum;
  for (const DiscLight& disc : discs) {
    if (covers(disc, direction)) sum += disc.radiance;
  }
  return sum;
}

// Mean of `light` over the directions that samples x samples places of a pixel see; places that
// see nothing count as black.
template <typename Light>
RgbD pixel_mean(Projection projection, const Image& image, int x, int y, int samples,
                const Light& light) {
  RgbD sum;
  for (int j = 0; j < samples; ++j) {
    for (int i = 0; i < samples; ++i) {
      const auto direction =
          projection_direction(projection, (x + (i + 0.5) / samples) / image.width,
                               (y + (j + 0.5) / samples) / image.height);
      if (direction) sum += light(*direction);
    }
  }
  return sum * (1.0 / (samples * samples));
}

int picture_height(Projection projection, int size) {
  switch (projection) {
    case Projection::latlong:
      return size / 2;
    case Projection::angular:
      return size;
    case Projection::vertical_cross:
      return size / 3 * 4;
  }
  return 0;
}

}  // namespace

double DiscLight::solid_angle() const {
  const double s = std::sin(0.5 * half_angle);
  return 4 * kPi * s * s;  // 2 pi (1 - cos a) = 4 pi sin^2(a / 2), without the cancellation
}

RgbD EnvironmentModel::radiance(const Vec3& direction) const {
  return smooth(direction) + disc_light(discs, direction);
}

std::span<const EnvironmentEntry> environments() { return kEnvironments; }

EnvironmentModel make_environment(std::string_view name, std::uint64_t seed) {
  std::string names;
  for (const EnvironmentEntry& entry : kEnvironments) {
    if (entry.name == name) return entry.make(seed);
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw Error(ErrorKind::invalid_argument,
              fmt::format("environment \"{}\" is not known, wanted one of {}", name, names));
}

Image draw_environment(const EnvironmentModel& model, Projection projection, int size) {
  const int multiple = projection == Projection::latlong          ? 2
                       : projection == Projection::vertical_cross ? 3
                                                                  : 1;
  if (size < 8 || size > 16384 || size % multiple != 0) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("environment size is {}, wanted 8 to 16384 and a multiple of {} for {}",
                            size, multiple, projection_name(projection)));
  }
  Image image(size, picture_height(projection, size));
  // The angle from a pixel's middle to its farthest corner, from above: a pixel of the angular map
  // spans 2 pi / size sideways at most (angle / pi is the distance from the middle, and circles
  // shrink by sin(angle) / angle), one of the cross 2 / (size / 3) at the middle of a face, one of
  // the lat-long map 2 pi / size. Twice the larger of these is safe for the diagonal too.
  const double pixel_reach = 2 * 2 * kPi / size;
  parallel_for(image.height, [&](int y) {
    std::vector<DiscLight> near;
    for (int x = 0; x < image.width; ++x) {
      RgbD value = pixel_mean(projection, image, x, y, 4, model.smooth);
      const auto middle =
          projection_direction(projection, (x + 0.5) / image.width, (y + 0.5) / image.height);
      near.clear();
      for (const DiscLight& disc : model.discs) {
        DiscLight grown = disc;
        grown.half_angle = std::min(kPi, disc.half_angle + pixel_reach);
        // A pixel on the rim of the layout may have its middle outside: look at every disc then.
        if (!middle || covers(grown, *middle)) near.push_back(disc);
      }
      if (!near.empty()) {
        value += pixel_mean(projection, image, x, y, 16,
                            [&](const Vec3& direction) { return disc_light(near, direction); });
      }
      image.at(x, y) = Rgb(value);
    }
  });
  return image;
}

}  // namespace haarlight::data_gen
