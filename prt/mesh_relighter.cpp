// Sums of rows become the radiance of vertices.

#include "prt/mesh_relighter.h"

#include <utility>

#include "core/error.h"
#include "prt/finish_rows.h"

namespace haarlight {
namespace {

Transport checked(Transport transport) {
  if (transport.kind() != TransportKind::mesh) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of a picture, expected one of a mesh");
  }
  return transport;
}

}  // namespace

MeshRelighter::MeshRelighter(Transport transport)
    : sums_(checked(std::move(transport))), radiance_(sums_.transport().info().output_count()) {}

RelightStats MeshRelighter::apply(const LightingUpdate& update, UpdatePart part) {
  return apply_and_finish(sums_, update, radiance_, part);
}

}  // namespace haarlight
