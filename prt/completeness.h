// Whether a transport shows all that was asked for, and how well.

#pragma once

#include <optional>
#include <string>

namespace haarlight {

/// "43 % of tiles traced, the rest is a preview" from a transport's description (TransportInfo's
/// meta); nothing for a complete one.
std::string incomplete_note(const std::string& meta);

/// The measured_error of a transport's description (TransportInfo::meta): relative RMS of its
/// picture against what was traced, under the worst of the built-in lightings. None if it says
/// none.
std::optional<double> measured_error(const std::string& meta);

}  // namespace haarlight
