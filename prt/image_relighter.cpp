// Sums of rows become pixels.

#include "prt/image_relighter.h"

#include <cstddef>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/finish_rows.h"

namespace haarlight {
namespace {

const Transport& checked(const Transport& transport) {
  if (transport.kind() != TransportKind::image) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of a mesh, expected one of a picture");
  }
  return transport;
}

}  // namespace

ImageRelighter::ImageRelighter(Transport transport)
    : sums_(checked(transport)), picture_(sums_.transport().width(), sums_.transport().height()) {}

RelightStats ImageRelighter::apply(const LightingUpdate& update, UpdatePart part) {
  return apply_and_finish(sums_, update, picture_.pixels, part);
}

Image relight_once(const Transport& transport, std::span<const Rgb> lighting) {
  ImageRelighter relighter(transport);
  relighter.expect_resets(false);
  relighter.apply(full_update(transport.layout(), lighting));
  return relighter.picture();
}

SceneView::SceneView(const Transport& transport)
    : camera(checked(transport).info().camera), coverage(transport.coverage()) {}

void composite_environment(const SceneView& view, const Environment& environment,
                           const Rotation& rotation, Image& picture) {
  const Rotation back = rotation.transposed();  // where a direction was before it was turned
  parallel_for(picture.height, [&](int y) {
    for (int x = 0; x < picture.width; ++x) {
      const float uncovered = 1 - view.coverage[picture.index(x, y)];
      if (uncovered <= 0) continue;
      const Rgb behind = environment.radiance(back * view.camera.direction(x + 0.5, y + 0.5));
      picture.at(x, y) += uncovered * behind;
    }
  });
}

}  // namespace haarlight
