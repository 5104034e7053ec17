// Whether a transport shows all that was asked for.

#pragma once

#include <string>

namespace haarlight {

/// "43 % of tiles traced, the rest is a preview" from a transport's description (TransportInfo's
/// meta); nothing for a complete one.
std::string incomplete_note(const std::string& meta);

}  // namespace haarlight
