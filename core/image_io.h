// Reading and writing picture files. The only place that touches OpenImageIO.

#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "core/image.h"

namespace haarlight {

/// What the numbers of a picture with integer pixels mean.
enum class ImageEncoding {
  color,  ///< sRGB: made linear
  data    ///< plain numbers, 0 to 1: normals, roughness, masks
};

/// Reads any format OpenImageIO knows (EXR, Radiance HDR, PNG, ...) as linear RGB floats. One
/// channel is copied to all three; channels past the third are ignored. 8- and 16-bit files are
/// taken as `encoding` says; float files are taken as linear already. Values are not checked here:
/// a NaN comes through (see wavelet/environment.h for the gate).
/// Throws Error{missing} if there is no such file, Error{format} if it is no readable picture or
/// is cut short, Error{io} if the system refuses.
Image load_image(const std::filesystem::path& file, ImageEncoding encoding = ImageEncoding::color);

/// The alpha channel of a picture, row-major from the top left, one value a pixel; empty if it has
/// none. Throws as load_image().
std::vector<float> load_alpha(const std::filesystem::path& file);

/// Writes by suffix: .exr and .hdr as linear 32-bit float (EXR with zip compression); .png as 8-bit
/// sRGB, where `image` must already be display-referred: linear in [0, 1], encoded here, clamped.
/// Atomic: the bytes appear under `file` only when complete; on any failure what was there before
/// is still there. Throws Error{invalid_argument} for another suffix or a picture without pixels,
/// Error{io} if the system refuses.
void save_image(const std::filesystem::path& file, const Image& image);

}  // namespace haarlight
