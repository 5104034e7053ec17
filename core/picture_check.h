// Whether what a picture file promises can be inside it.

#pragma once

#include <filesystem>

namespace haarlight {

/// Readers of PNG and EXR take the room that a part of the file asks for, up to 2 GiB, before they
/// find that it is not there, and those of JPEG, BMP and WebP that for all pixels, up to 16 GiB,
/// before they tell how many there are; this looks first. Throws Error{format} naming the file and
/// the place. Other files are none of its business.
void check_picture_parts(const std::filesystem::path& file);

}  // namespace haarlight
