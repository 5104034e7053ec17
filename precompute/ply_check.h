// Whether a PLY file holds as much as its header promises.

#pragma once

#include <filesystem>

namespace haarlight {

/// Readers fill up a PLY file that was cut short with zeros and say nothing; this does. Throws
/// Error{format} naming the file, what was found and what its header promises, or the item whose
/// list is longer than the file: readers take the room for it first. Error{io} if it cannot be
/// read.
void check_ply_length(const std::filesystem::path& file);

}  // namespace haarlight
