// Walks the chunks of a PNG and the attributes of an EXR header.

#include "core/picture_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "core/error.h"
#include "core/input_file.h"

namespace haarlight {
namespace {

constexpr unsigned char kPng[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr unsigned char kExr[4] = {0x76, 0x2f, 0x31, 0x01};

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
      std::uint64_t length = 0;
      for (std::size_t i = 4; i-- > 0;) length = length << 8 | byte(size + i);
      require(length, at + size + 4);
      at += size + 4 + length;
    }
  }

 private:
  unsigned byte(std::size_t i) const { return std::to_integer<unsigned>(buffer_[i]); }

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
}

}  // namespace haarlight
