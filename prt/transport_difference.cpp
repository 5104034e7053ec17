// How far apart the pictures of two transports are, whatever the light.

#include "prt/transport_difference.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "prt/finish_rows.h"
#include "prt/image_relighter.h"
#include "prt/mesh_relighter.h"
#include "prt/prior_lighting.h"

namespace haarlight {
namespace {

double square(const Rgb& c) {
  const RgbD d(c);
  return d.r * d.r + d.g * d.g + d.b * d.b;
}

// Radiance of every output under a grey lighting.
std::vector<Rgb> shown(const Transport& transport, const std::vector<float>& lighting) {
  std::vector<Rgb> light;
  for (const float l : lighting) light.push_back({l, l, l});
  if (transport.kind() == TransportKind::image) return relight_once(transport, light).pixels;
  MeshRelighter relighter(transport);
  relighter.apply(full_update(transport.layout(), light));
  return {relighter.radiance().begin(), relighter.radiance().end()};
}

}  // namespace

TransportDifference transport_difference(const Transport& a, const Transport& b) {
  const TransportInfo &x = a.info(), &y = b.info();
  if (x.face_size != y.face_size || x.kind != y.kind || x.output_count() != y.output_count()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("transports have faces of {} and {} and {} and {} outputs, expected "
                            "two of one kind, face size and number of outputs",
                            x.face_size, y.face_size, x.output_count(), y.output_count()));
  }
  TransportDifference d;
  double sum = 0;
  for (const std::vector<float>& lighting : prior_lightings(a.layout())) {
    const std::vector<Rgb> p = shown(a, lighting), q = shown(b, lighting);
    double difference = 0, energy = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      difference += square(p[i] - q[i]);
      energy += square(q[i]);
    }
    const double relative = energy > 0 ? std::sqrt(difference / energy) : difference > 0 ? 1 : 0;
    d.of_lightings.push_back(relative);
    sum += relative * relative;
  }
  d.relative_rmse = std::sqrt(sum / static_cast<double>(d.of_lightings.size()));
  return d;
}

}  // namespace haarlight
