// Finds out early whether results will have a place.

#pragma once

#include <filesystem>

namespace haarlight {

/// Throws Error{io} unless a file can be made at `file`. Leaves nothing behind and touches nothing
/// that is there.
void require_writable_file(const std::filesystem::path& file);

/// Makes the folder and its parents where missing, and throws Error{io} unless files can be made
/// in it.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace haarlight
