// Walks the chunks of a PNG, the attributes of an EXR header, the segments of a JPEG; looks at the
// size that a BMP or a WebP has.

#include "core/picture_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/input_file.h"

namespace haarlight {
namespace {

constexpr unsigned char kPng[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr unsigned char kExr[4] = {0x76, 0x2f, 0x31, 0x01};
constexpr unsigned char kJpeg[3] = {0xff, 0xd8, 0xff};
constexpr unsigned char kBmp[2] = {'B', 'M'};
constexpr unsigned char kRiff[4] = {'R', 'I', 'F', 'F'};

// Attributes of an EXR whose values are all of one size, in bytes.
constexpr std::pair<std::string_view, std::uint64_t> kExrKinds[] = {
    {"box2f", 16},      {"box2i", 16},    {"chromaticities", 32},
    {"compression", 1}, {"double", 8},    {"envmap", 1},
    {"float", 4},       {"int", 4},       {"keycode", 28},
    {"m33d", 72},       {"m33f", 36},     {"m44d", 128},
    {"m44f", 64},       {"v2d", 16},      {"v2f", 8},
    {"v2i", 8},         {"v3d", 24},      {"v3f", 12},
    {"v3i", 12},        {"rational", 8},  {"tiledesc", 9},
    {"timecode", 8},    {"lineOrder", 1}, {"deepImageState", 1},
};

// Pixels that a byte of file can hold; no format of these packs more but for pictures of one
// colour.
constexpr std::uint64_t kMostPixels = 16384;

class Walk {
 public:
  explicit Walk(const std::filesystem::path& file) : file_(file), input_(file) {}

  bool begins_with(std::span<const unsigned char> bytes) {
    return look(0, bytes.size()) == bytes.size() &&
           std::memcmp(buffer_.data(), bytes.data(), bytes.size()) == 0;
  }

  // Length (big-endian), name, bytes, checksum, the next one; IEND is the last.
  void png() {
    for (std::uint64_t at = sizeof kPng; at + 12 <= input_.size();) {
      look(at, 8);
      std::uint64_t length = 0;
      for (std::size_t i = 0; i < 4; ++i) length = length << 8 | byte(i);
      require(length, at + 12);
      if (std::memcmp(buffer_.data() + 4, "IEND", 4) == 0) return;
      at += 12 + length;
    }
  }

  // Marker, length (big-endian, itself included), bytes, the next one; a frame's begins with bits a
  // sample, height and width.
  void jpeg() {
    for (std::uint64_t at = 2; look(at, 9) == 9;) {
      const unsigned marker = byte(1);
      if (byte(0) != 0xff) return;
      if (marker == 0xff) {  // fills up
        ++at;
        continue;
      }
      constexpr unsigned kFirstFrame = 0xc0, kLastFrame = 0xcf, kTables = 0xc4, kReserved = 0xc8,
                         kArithmetic = 0xcc, kScan = 0xda;
      if (marker == kScan) return;
      if (marker >= kFirstFrame && marker <= kLastFrame && marker != kTables &&
          marker != kReserved && marker != kArithmetic) {
        return promise(byte(7) << 8 | byte(8), byte(5) << 8 | byte(6));
      }
      at += 2 + std::uint64_t{byte(2) << 8 | byte(3)};
    }
  }

  // Width and height follow a header of 18 bytes; the latter is negative from the top down.
  void bmp() {
    if (look(18, 8) < 8) return;
    const auto size = [&](std::size_t at) {
      const std::uint32_t bits = little(at, 4);
      return bits & 0x80000000u ? ~bits + 1 : bits;
    };
    promise(size(0), size(4));
  }

  void webp() {
    if (look(8, 22) < 22 || std::memcmp(buffer_.data(), "WEBPVP8", 7) != 0) return;
    const char kind = static_cast<char>(byte(7));
    if (kind == ' ') promise(little(18, 2) & 0x3fff, little(20, 2) & 0x3fff);
    if (kind == 'L') promise((little(13, 4) & 0x3fff) + 1, (little(13, 4) >> 14 & 0x3fff) + 1);
    if (kind == 'X') promise(little(16, 3) + 1, little(19, 3) + 1);
  }

  // Name and type, each with a zero behind it, length (little-endian), bytes, the next one; an
  // empty name ends the header of a part, and an empty part those of a file of several.
  void exr() {
    look(4, 4);
    const bool several = (byte(1) & 0x10) != 0;
    bool part_is_empty = true;
    for (std::uint64_t at = 8;;) {
      const std::size_t found = look(at, buffer_.size());
      if (found == 0) return;
      if (byte(0) == 0) {
        if (!several || part_is_empty) return;
        part_is_empty = true;
        ++at;
        continue;
      }
      part_is_empty = false;
      const std::size_t type = after_zero(0, found), size = after_zero(type, found);
      if (size + 4 > found) require(4, at + size);  // cut short, or a name too long for any reader
      if (size + 4 > buffer_.size()) return;
      const std::string kind(reinterpret_cast<const char*>(buffer_.data()) + type, size - type - 1);
      const std::uint64_t length = little(size, 4);
      at += size + 4;
      require(length, at);
      if (takes(kind, at, length) != length) {
        throw Error(ErrorKind::format,
                    fmt::format("{}: is damaged: a {} takes {} bytes at byte {}, expected the {} "
                                "that it says it takes",
                                file_.string(), kind, takes(kind, at, length), at, length));
      }
      at += length;
    }
  }

 private:
  // What the reader of an attribute of an EXR takes, whatever length the attribute says it has:
  // from there on it would read lengths where there are none. Kinds that go by their length take
  // it.
  std::uint64_t takes(std::string_view kind, std::uint64_t at, std::uint64_t length) {
    for (const auto& [name, bytes] : kExrKinds) {
      if (kind == name) return bytes;
    }
    const std::uint64_t end = at + length;
    std::uint64_t next = at;
    if (kind == "chlist") {
      // Names, each with a zero and sixteen bytes behind it; an empty one ends them.
      while (next < end) {
        const std::size_t name = after_zero(0, look(next, buffer_.size()));
        if (name == 1) return next + 1 - at;
        next += name + 16;
      }
      return next + 1 - at;
    }
    if (kind == "stringvector") {
      while (next < end && look(next, 4) == 4) next += 4 + std::uint64_t{little(0, 4)};
      return next - at;
    }
    if (kind == "preview" && look(at, 8) == 8) {
      return 8 + 4 * std::uint64_t{little(0, 4)} * little(4, 4);
    }
    return length;
  }

  unsigned byte(std::size_t i) const { return std::to_integer<unsigned>(buffer_[i]); }

  std::uint32_t little(std::size_t at, std::size_t bytes) const {
    std::uint32_t value = 0;
    for (std::size_t i = bytes; i-- > 0;) value = value << 8 | byte(at + i);
    return value;
  }

  void promise(std::uint64_t width, std::uint64_t height) const {
    if (width * height <= kMostPixels * input_.size()) return;
    throw Error(ErrorKind::format,
                fmt::format("{}: has {}x{} pixels in {} bytes, expected more of them: is it cut "
                            "short?",
                            file_.string(), width, height, input_.size()));
  }

  // Fills the buffer from `at` on; how much there was.
  std::size_t look(std::uint64_t at, std::size_t most) {
    const std::uint64_t left = at < input_.size() ? input_.size() - at : 0;
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(left, most));
    input_.read(at, std::span(buffer_).first(count));
    return count;
  }

  std::size_t after_zero(std::size_t from, std::size_t end) const {
    while (from < end && byte(from) != 0) ++from;
    return std::min(from + 1, end);
  }

  void require(std::uint64_t length, std::uint64_t at) const {
    if (at <= input_.size() && length <= input_.size() - at) return;
    throw Error(ErrorKind::format,
                fmt::format("{}: is cut short or damaged: a part of {} bytes at byte {} of {}",
                            file_.string(), length, at, input_.size()));
  }

  const std::filesystem::path& file_;
  InputFile input_;
  std::array<std::byte, 1024> buffer_{};
};

}  // namespace

void check_picture_parts(const std::filesystem::path& file) {
  Walk walk(file);
  if (walk.begins_with(kPng)) walk.png();
  if (walk.begins_with(kExr)) walk.exr();
  if (walk.begins_with(kJpeg)) walk.jpeg();
  if (walk.begins_with(kBmp)) walk.bmp();
  if (walk.begins_with(kRiff)) walk.webp();
}

}  // namespace haarlight
