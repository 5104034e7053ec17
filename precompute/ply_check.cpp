// Whether a PLY file holds as much as its header promises.

#include "precompute/ply_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"

namespace haarlight {
namespace {

struct Property {
  std::uint64_t length_bytes = 0;  // of a list's length; 0: no list
  bool length_signed = false;
  std::uint64_t bytes = 0;  // of a value
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> property;

  bool has_list() const {
    return std::any_of(property.begin(), property.end(),
                       [](const Property& p) { return p.length_bytes > 0; });
  }
};

enum class Coding { text, little, big };

// Bytes of a PLY number type, 0 for a word that is none.
std::uint64_t type_bytes(const std::string& type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "double" || type == "float64") return 8;
  if (type == "int" || type == "uint" || type == "int32" || type == "uint32" || type == "float" ||
      type == "float32") {
    return 4;
  }
  return 0;
}

class Checker {
 public:
  explicit Checker(const std::filesystem::path& file) : name_(file.string()) {
    in_.open(file, std::ios::binary);
    if (!in_) fail(ErrorKind::io, "cannot be opened for reading");
    read_header();
    if (coding_ == Coding::text) {
      for (const Element& e : elements_) check_lines(e);
      return;
    }
    const auto header = static_cast<std::uint64_t>(in_.tellg());
    left_ = std::filesystem::file_size(file) - header;
    whole_ = left_;
    for (const Element& e : elements_) check_bytes(e);
  }

 private:
  [[noreturn]] void fail(ErrorKind kind, const std::string& why) const {
    throw Error(kind, fmt::format("{}: {}", name_, why));
  }
  [[noreturn]] void too_long(const Element& e, std::uint64_t item, std::int64_t length) const {
    fail(ErrorKind::format, fmt::format("{} {} has a list of {}, expected one that the file has "
                                        "room for",
                                        e.name, item, length));
  }

  void read_header() {
    std::string line;
    while (std::getline(in_, line)) {
      std::istringstream words(line);
      std::string word, type;
      words >> word;
      if (word == "format") {
        words >> type;
        coding_ = type == "ascii"               ? Coding::text
                  : type == "binary_big_endian" ? Coding::big
                                                : Coding::little;
      } else if (word == "element") {
        elements_.emplace_back();
        words >> elements_.back().name >> elements_.back().count;
      } else if (word == "property" && !elements_.empty()) {
        words >> type;
        Property property;
        if (type == "list") {
          words >> type;
          property.length_bytes = type_bytes(type);
          property.length_signed = !type.starts_with("u");
          words >> type;
        }
        property.bytes = type_bytes(type);
        elements_.back().property.push_back(property);
      } else if (word == "end_header") {
        return;
      }
    }
    fail(ErrorKind::format, "the PLY header has no end, expected end_header");
  }

  // A line for each item.
  void check_lines(const Element& e) {
    const bool has_list = e.has_list();
    std::string line;
    for (std::uint64_t item = 0; item < e.count;) {
      if (!std::getline(in_, line)) {
        fail(ErrorKind::format,
             fmt::format("{} {}s after the header, expected {}", item, e.name, e.count));
      }
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      if (has_list) check_lists_of(e, item, line);
      ++item;
    }
  }

  void check_lists_of(const Element& e, std::uint64_t item, const std::string& line) const {
    const char* at = line.c_str();
    const auto next = [&at] {
      char* end = nullptr;
      const double value = std::strtod(at, &end);
      const bool found = end != at;
      at = end;
      return found ? value : 0.0;
    };
    for (const Property& p : e.property) {
      const double value = next();
      if (p.length_bytes == 0) continue;
      // Each value takes a character and a blank.
      const auto room = static_cast<double>(line.size()) / 2;
      if (!(value >= 0) || value > room) {
        too_long(e, item, static_cast<std::int64_t>(std::clamp(value, -1.0, 1e18)));
      }
      for (int i = 0; i < static_cast<int>(value); ++i) next();
    }
  }

  // As bytes of the data that are there.
  void take(const Element& e, std::uint64_t item, std::uint64_t bytes) {
    if (bytes > left_) {
      fail(ErrorKind::format, fmt::format("{} bytes after the header end at {} {}, expected {} of "
                                          "them",
                                          whole_, e.name, item, e.count));
    }
    left_ -= bytes;
  }

  void check_bytes(const Element& e) {
    if (!e.has_list()) {
      std::uint64_t each = 0, all = 0;
      for (const Property& p : e.property) each += p.bytes;
      if (each > 0 && (__builtin_mul_overflow(each, e.count, &all) || all > left_)) {
        take(e, left_ / each, left_ + 1);
      }
      take(e, 0, all);
      in_.seekg(static_cast<std::streamoff>(all), std::ios::cur);
      return;
    }
    for (std::uint64_t item = 0; item < e.count; ++item) {
      for (const Property& p : e.property) {
        std::uint64_t values = 1;
        if (p.length_bytes > 0) {
          take(e, item, p.length_bytes);
          const std::int64_t length = read_length(p);
          if (length < 0 || static_cast<std::uint64_t>(length) > left_) too_long(e, item, length);
          values = static_cast<std::uint64_t>(length);
        }
        take(e, item, values * p.bytes);
        in_.ignore(static_cast<std::streamsize>(values * p.bytes));
      }
    }
  }

  std::int64_t read_length(const Property& p) {
    std::array<char, 8> bytes{};
    in_.read(bytes.data(), static_cast<std::streamsize>(p.length_bytes));
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < p.length_bytes; ++i) {
      const std::size_t at = coding_ == Coding::big ? i : p.length_bytes - 1 - i;
      value = value << 8 | static_cast<unsigned char>(bytes[at]);
    }
    const std::uint64_t sign = std::uint64_t{1} << (8 * p.length_bytes - 1);
    if (p.length_signed && (value & sign) != 0) value |= ~(sign | (sign - 1));
    return static_cast<std::int64_t>(value);
  }

  std::string name_;
  std::ifstream in_;
  Coding coding_ = Coding::little;
  std::vector<Element> elements_;
  std::uint64_t whole_ = 0, left_ = 0;  // bytes after the header
};

}  // namespace

void check_ply_length(const std::filesystem::path& file) { Checker{file}; }

}  // namespace haarlight
