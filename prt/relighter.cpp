// Relighters made by kind, and used once.

#include "prt/relighter.h"

#include "prt/finish_rows.h"
#include "prt/image_relighter.h"
#include "prt/picture_relighter.h"

namespace haarlight {

std::unique_ptr<Relighter> make_relighter(const RelighterFactory& make,
                                          const Transport& transport) {
  return make ? make(transport) : std::make_unique<PictureRelighter>(transport);
}

Image relight_picture_once(const Transport& transport, std::span<const Rgb> lighting,
                           const Camera& camera, const RelighterFactory& make) {
  if (transport.kind() == TransportKind::image) return relight_once(transport, lighting);
  const std::unique_ptr<Relighter> relighter = make_relighter(make, transport);
  relighter->expect_resets(false);
  relighter->set_exact(true);
  relighter->set_camera(camera);
  relighter->apply(full_update(transport.layout(), lighting));
  return relighter->picture();
}

}  // namespace haarlight
