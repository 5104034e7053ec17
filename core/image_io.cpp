// Reading and writing picture files, through OpenImageIO.

#include "core/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <exception>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/picture_check.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;

static_assert(sizeof(Rgb) == 3 * sizeof(float), "pixels are handed over as packed floats");

/// A header can promise any size; this many pixels (16384 x 16384) is more than any light probe
/// and little enough to allocate.
constexpr std::int64_t kMostPixels = std::int64_t{1} << 28;

/// Bytes of pixels that a byte of file can hold: deflate packs 1032 to 1, and no format of pictures
/// does better; but for EXR a pixel of one bit counts as a byte. What a few bytes of header promise
/// is not allocated.
constexpr std::uintmax_t kMostPacked = 16384, kMostPackedExr = 2048;

/// OpenImageIO's messages may have several lines and an end of line.
std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\r', ' ');
  std::size_t at = 0;
  while ((at = text.find('\n')) != std::string::npos) text.replace(at, 1, "; ");
  while (!text.empty() && (text.back() == ' ' || text.back() == ';' || text.back() == '.')) {
    text.pop_back();
  }
  return text.empty() ? "no reason given" : text;
}

[[noreturn]] void fail(ErrorKind kind, const fs::path& file, const std::string& what) {
  throw Error(kind, fmt::format("{}: {}", file.string(), what));
}

float linear_from_srgb(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f
                             : static_cast<float>(std::pow((encoded + 0.055) / 1.055, 2.4));
}

/// The nearest of 256 steps. A NaN fails both comparisons and becomes 0.
std::uint8_t srgb_byte(float linear) {
  if (!(linear > 0)) return 0;
  if (!(linear < 1)) return 255;
  const double encoded = linear <= 0.0031308
                             ? 12.92 * static_cast<double>(linear)
                             : 1.055 * std::pow(static_cast<double>(linear), 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * encoded));
}

/// Refuses early, with the system's reason, what OpenImageIO would only call unreadable.
void check_readable(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) {
    fail(ErrorKind::missing, file, "no such file, expected a picture");
  }
  if (error) fail(ErrorKind::io, file, "cannot read: " + error.message());
  if (fs::is_directory(status)) fail(ErrorKind::format, file, "is a folder, expected a picture");
  if (::access(file.c_str(), R_OK) != 0) {
    fail(ErrorKind::io, file, "cannot read: " + std::generic_category().message(errno));
  }
}

void check_shape(const fs::path& file, const OIIO::ImageSpec& spec) {
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1 || spec.depth > 1 || spec.deep) {
    fail(ErrorKind::format, file,
         fmt::format("has {}x{}x{} pixels of {} channels{}, expected one flat picture", spec.width,
                     spec.height, spec.depth, spec.nchannels, spec.deep ? " in deep samples" : ""));
  }
  if (std::int64_t{spec.width} * spec.height > kMostPixels) {
    fail(ErrorKind::format, file,
         fmt::format("has {}x{} pixels, expected at most {} in all", spec.width, spec.height,
                     kMostPixels));
  }
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  const bool exr = file.extension() == ".exr" || file.extension() == ".EXR";
  if (!error && spec.image_bytes(true) > (exr ? kMostPackedExr : kMostPacked) * bytes) {
    fail(ErrorKind::format, file,
         fmt::format("has {}x{} pixels in {} bytes, expected more of them: is it cut short?",
                     spec.width, spec.height, bytes));
  }
}

/// Whose file it is by its first bytes, else by its name. Left to itself OpenImageIO lets all its
/// readers have a go at a file that the first of them refuses: slow, and many more that would have
/// to bear damaged bytes.
std::string reader_of(const fs::path& file) {
  std::array<char, 8> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  const std::string_view bytes(head.data(), head.size());
  using namespace std::string_view_literals;
  constexpr std::pair<std::string_view, const char*> kReaders[] = {
      {"\x76\x2f\x31\x01"sv, "openexr"},
      {"#?"sv, "hdr"},
      {"\x89PNG"sv, "png"},
      {"\xff\xd8\xff"sv, "jpeg"},
      {"II\x2a\0"sv, "tiff"},
      {"MM\0\x2a"sv, "tiff"},
      {"RIFF"sv, "webp"},
      {"BM"sv, "bmp"},
  };
  for (const auto& [magic, reader] : kReaders) {
    if (bytes.substr(0, magic.size()) == magic) return reader;
  }
  // Those that nothing begins with, or by one byte of many. Never any other: OpenImageIO has
  // readers of films and of pictures that take all the room that a byte asks for.
  constexpr std::pair<std::string_view, const char*> kSuffixes[] = {
      {".exr", "openexr"}, {".hdr", "hdr"},  {".png", "png"},   {".jpg", "jpeg"},
      {".jpeg", "jpeg"},   {".tif", "tiff"}, {".tiff", "tiff"}, {".tga", "targa"},
      {".ppm", "pnm"},     {".pgm", "pnm"},  {".pfm", "pnm"}};
  std::string suffix = file.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const auto& [name, reader] : kSuffixes) {
    if (suffix == name) return reader;
  }
  return {};
}

std::unique_ptr<OIIO::ImageInput> open_input(const fs::path& file) {
  check_readable(file);
  check_picture_parts(file);
  // Colours must come as they are stored: a texture's alpha is no reason to darken them.
  OIIO::ImageSpec hints;
  hints.attribute("oiio:UnassociatedAlpha", 1);
  const std::string reader = reader_of(file);
  auto input = reader.empty() ? nullptr : OIIO::ImageInput::create(reader);
  if (!input) {
    OIIO::geterror();
    fail(ErrorKind::format, file,
         "is no readable picture by content or suffix, expected EXR, HDR, PNG, JPEG, TIFF, WebP, "
         "BMP, "
         "TGA or PNM");
  }
  OIIO::ImageSpec spec;
  if (!input->open(file.string(), spec, hints)) {
    fail(ErrorKind::format, file, "is no readable picture: " + one_line(input->geterror()));
  }
  check_shape(file, spec);
  return input;
}

// Some readers report success for scanlines that are not there, and only leave a message.
void check_complete(const fs::path& file, const OIIO::ImageInput& input, bool success) {
  if (success && !input.has_error()) return;
  fail(ErrorKind::format, file, "is cut short or damaged: " + one_line(input.geterror()));
}

// What readers throw of themselves, of damaged files, becomes an error of ours.
template <typename Read>
auto guarded(const fs::path& file, const Read& read) {
  try {
    return read();
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    fail(ErrorKind::format, file, "is cut short or damaged: " + one_line(error.what()));
  }
}

Image load(const fs::path& file, ImageEncoding encoding) {
  const auto input = open_input(file);
  const OIIO::ImageSpec spec = input->spec();
  Image image(spec.width, spec.height);
  bool complete = true;
  if (spec.nchannels >= 3) {
    complete = input->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, image.pixels.data());
  } else {
    std::vector<float> grey(image.pixels.size());
    complete = input->read_image(0, 0, 0, 1, OIIO::TypeDesc::FLOAT, grey.data());
    std::transform(grey.begin(), grey.end(), image.pixels.begin(),
                   [](float value) { return Rgb(value, value, value); });
  }
  check_complete(file, *input, complete);
  if (encoding == ImageEncoding::color && !spec.format.is_floating_point()) {
    for (Rgb& pixel : image.pixels) {
      pixel = {linear_from_srgb(pixel.r), linear_from_srgb(pixel.g), linear_from_srgb(pixel.b)};
    }
  }
  return image;
}

std::vector<float> alpha_of(const fs::path& file) {
  const auto input = open_input(file);
  const OIIO::ImageSpec spec = input->spec();
  // Files that name no alpha may have one all the same, behind grey or colour.
  int channel = spec.alpha_channel;
  if (channel < 0 && (spec.nchannels == 2 || spec.nchannels == 4)) channel = spec.nchannels - 1;
  if (channel < 0) return {};
  std::vector<float> alpha(static_cast<std::size_t>(spec.width) *
                           static_cast<std::size_t>(spec.height));
  const bool complete =
      input->read_image(0, 0, channel, channel + 1, OIIO::TypeDesc::FLOAT, alpha.data());
  check_complete(file, *input, complete);
  return alpha;
}

// The bytes of a picture's file. They are made in memory, and written by AtomicFile: writers of
// pictures buffer, and a disk that is full when their last buffer goes out is no error to all of
// them.
std::vector<unsigned char> encode(const fs::path& file, const OIIO::ImageSpec& spec,
                                  const void* pixels) {
  OIIO::Filesystem::IOVecOutput memory;
  auto output = OIIO::ImageOutput::create(file.string());
  if (!output) fail(ErrorKind::io, file, "cannot write: " + one_line(OIIO::geterror()));
  if (!output->set_ioproxy(&memory) || !output->open(file.string(), spec) ||
      !output->write_image(spec.format, pixels) || !output->close()) {
    fail(ErrorKind::io, file, "cannot write: " + one_line(output->geterror()));
  }
  return memory.buffer();
}

std::vector<unsigned char> encode_floats(const fs::path& file, const Image& image,
                                         bool with_compression) {
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::FLOAT);
  if (with_compression) spec.attribute("compression", "zip");
  // EXR would be stamped with the time of writing, and equal pictures would differ as files.
  spec.attribute("DateTime", "2000:01:01 00:00:00");
  return encode(file, spec, image.pixels.data());
}

std::vector<unsigned char> encode_png(const fs::path& file, const Image& image) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * image.pixels.size());
  for (const Rgb& pixel : image.pixels) {
    bytes.push_back(srgb_byte(pixel.r));
    bytes.push_back(srgb_byte(pixel.g));
    bytes.push_back(srgb_byte(pixel.b));
  }
  OIIO::ImageSpec spec(image.width, image.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  return encode(file, spec, bytes.data());
}

}  // namespace

Image load_image(const fs::path& file, ImageEncoding encoding) {
  return guarded(file, [&] { return load(file, encoding); });
}

std::vector<float> load_alpha(const fs::path& file) {
  return guarded(file, [&] { return alpha_of(file); });
}

void save_image(const fs::path& file, const Image& image) {
  std::string suffix = file.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (suffix != ".exr" && suffix != ".hdr" && suffix != ".png") {
    fail(ErrorKind::invalid_argument, file,
         fmt::format("suffix is \"{}\", expected .exr, .hdr or .png", suffix));
  }
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() !=
          static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    fail(ErrorKind::invalid_argument, file,
         fmt::format("picture to write is {}x{} with {} pixels, expected width x height, not zero",
                     image.width, image.height, image.pixels.size()));
  }
  AtomicFile out(file);  // first, so that a place that cannot be written to costs no work
  const std::vector<unsigned char> bytes =
      suffix == ".png" ? encode_png(file, image) : encode_floats(file, image, suffix == ".exr");
  out.write(bytes.data(), bytes.size());
  out.commit();
}

}  // namespace haarlight
