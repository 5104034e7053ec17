// PLY files as a reader that trusts them can bear them.

#pragma once

#include <filesystem>
#include <string>

namespace haarlight {

/// Reads a PLY file and says the same in a plain one: binary, the header without comments (but the
/// texture that some writers name in one), vertices, then faces, and nothing else. Readers in use
/// fill up files that were cut short with zeros, take the room for a list before they look for it,
/// write past their arrays where an element comes twice, lose properties behind a comment and a
/// first byte that looks like an end of line. Throws Error{format} of one line that names the file,
/// the item and what is wrong with it; Error{missing, io} if it cannot be read.
std::string plain_ply(const std::filesystem::path& file);

}  // namespace haarlight
