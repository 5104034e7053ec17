// How deep a JSON text nests.

#pragma once

#include <string_view>

namespace haarlight {

/// Whether lists and objects of `text` stand more than kMostJsonDepth in each other. Readers of
/// JSON, ours and those of others, go down a level a call: what nests deeper ends them with a full
/// stack, so this is asked first. Text that is no JSON may get either answer.
inline constexpr int kMostJsonDepth = 128;
bool json_nests_too_deep(std::string_view text);

}  // namespace haarlight
