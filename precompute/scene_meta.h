// What a transport file says of the scene it was made from.

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "precompute/scene.h"

namespace haarlight {

/// Name, sizes and what the importer mended.
nlohmann::json scene_meta(const Scene& scene);

}  // namespace haarlight
