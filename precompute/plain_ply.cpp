// PLY files as a reader that trusts them can bear them.

#include "precompute/plain_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/input_file.h"

namespace haarlight {
namespace {

struct Type {
  const char* name;  // as it is written
  std::uint64_t bytes;
  bool is_signed, floating;
};
constexpr std::array<Type, 8> kTypes = {{{"char", 1, true, false},
                                         {"uchar", 1, false, false},
                                         {"short", 2, true, false},
                                         {"ushort", 2, false, false},
                                         {"int", 4, true, false},
                                         {"uint", 4, false, false},
                                         {"float", 4, true, true},
                                         {"double", 8, true, true}}};
constexpr const Type& kUnsigned = kTypes[5];

const Type* find_type(std::string_view name) {
  constexpr std::array<const char*, 8> kOthers = {"int8",  "uint8",  "int16",   "uint16",
                                                  "int32", "uint32", "float32", "float64"};
  for (std::size_t i = 0; i < kTypes.size(); ++i) {
    if (name == kTypes[i].name || name == kOthers[i]) return &kTypes[i];
  }
  return nullptr;
}

struct Property {
  std::string name;
  const Type* length = nullptr;  // of a list's length; null: no list
  const Type* value = nullptr;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> property;
  std::string bytes;  // plain
};

// A list that a face's corners, or their texture coordinates, are in.
enum class Role { other, corners, coordinates };
Role role(const Property& p) {
  if (!p.length) return Role::other;
  if (p.name == "vertex_index" || p.name == "vertex_indices") return Role::corners;
  return p.name == "texcoord" ? Role::coordinates : Role::other;
}

enum class Coding { text, little, big };

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\0'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

// Cuts the first word off.
std::string_view next_word(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(" \t\r"));
  text.remove_prefix(word.size());
  return word;
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : name_(file.string()) {
    const InputFile in(file);
    text_.resize(in.size());
    in.read(0, std::as_writable_bytes(std::span(text_)));
    read_header();
    body_ = at_;
    for (Element& e : elements_) {
      const bool wanted = &e == find("vertex") || &e == find("face");
      if (coding_ == Coding::text) {
        read_lines(e, wanted);
      } else {
        read_bytes(e, wanted);
      }
    }
    text_ = {};
  }

  std::string plain() {
    std::string out = fmt::format("ply\nformat binary_{}_endian 1.0\n",
                                  coding_ == Coding::big ? "big" : "little");
    if (!texture_.empty()) out += fmt::format("comment TextureFile {}\n", texture_);
    for (const char* name : {"vertex", "face"}) {
      if (const Element* e = find(name)) put_header(*e, out);
    }
    out += "end_header\n";
    const std::size_t header = out.size();
    for (const char* name : {"vertex", "face"}) {
      if (Element* e = find(name)) {
        out += e->bytes;
        e->bytes = {};
      }
    }
    // A first byte that looks like an end of line would be taken for one of the header's.
    if (out.size() > header && out[header] == '\n') out.insert(header, 1, '\n');
    if (out.size() == header) out += '\0';
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw Error(ErrorKind::format, fmt::format("{}: {}", name_, why));
  }
  [[noreturn]] void too_long(const Element& e, std::uint64_t item, std::int64_t length) const {
    fail(fmt::format("{} {} has a list of {}, expected one that the file has room for", e.name,
                     item, length));
  }

  // The one of that name, or null.
  Element* find(std::string_view name) {
    const auto e = std::find_if(elements_.begin(), elements_.end(),
                                [&](const Element& each) { return each.name == name; });
    return e == elements_.end() ? nullptr : &*e;
  }

  std::optional<std::string_view> next_line() {
    if (at_ >= text_.size()) return {};
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    const std::string_view line(text_.data() + at_, end - at_);
    at_ = end + 1;
    return line;
  }

  void read_header() {
    for (bool first = true;; first = false) {
      const auto line = next_line();
      if (!line) fail("the PLY header has no end, expected end_header");
      std::string_view rest = *line;
      const std::string_view word = next_word(rest);
      if (first) {
        if (word != "ply" && word != "PLY")
          fail("does not begin with \"ply\", expected a PLY file");
      } else if (word == "format") {
        read_format(rest);
      } else if (word == "comment") {
        if (next_word(rest) == "TextureFile") texture_ = printable(trimmed(rest));
      } else if (word == "element") {
        read_element(rest);
      } else if (word == "property") {
        read_property(rest);
      } else if (word == "end_header") {
        break;
      }
    }
    if (!format_) fail("the PLY header names no format, expected ascii or binary");
    if (!find("vertex")) fail("the PLY header has no element vertex, expected one");
    for (const Element& e : elements_) {
      if (e.name == "tristrips") fail("has strips of triangles, expected faces");
      if (e.property.empty() && (e.name == "vertex" || e.name == "face")) {
        fail(fmt::format("the PLY header's element {} has no properties", e.name));
      }
    }
  }

  static std::string printable(std::string_view text) {
    std::string out;
    for (const char c : text.substr(0, 1024)) {
      if (static_cast<unsigned char>(c) >= ' ') out += c;
    }
    return out;
  }

  void read_format(std::string_view rest) {
    const std::string_view coding = next_word(rest);
    if (coding == "ascii") {
      coding_ = Coding::text;
    } else if (coding == "binary_little_endian") {
      coding_ = Coding::little;
    } else if (coding == "binary_big_endian") {
      coding_ = Coding::big;
    } else {
      fail(
          fmt::format("format is \"{}\", expected ascii, binary_little_endian or "
                      "binary_big_endian",
                      printable(coding)));
    }
    format_ = true;
  }

  void read_element(std::string_view rest) {
    Element e;
    e.name = printable(next_word(rest));
    const std::string_view count = next_word(rest);
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), e.count);
    if (error != std::errc() || end != count.data() + count.size()) {
      fail(fmt::format("element {} has a count of \"{}\", expected a whole number", e.name,
                       printable(count)));
    }
    if (find(e.name)) fail(fmt::format("element {} comes twice", e.name));
    elements_.push_back(std::move(e));
  }

  void read_property(std::string_view rest) {
    if (elements_.empty()) fail("a property comes before the first element");
    Property p;
    std::string_view type = next_word(rest);
    if (type == "list") {
      type = next_word(rest);
      p.length = find_type(type);
      if (!p.length || p.length->floating) {
        fail(fmt::format("lengths of a list are of type \"{}\", expected whole numbers",
                         printable(type)));
      }
      type = next_word(rest);
    }
    p.value = find_type(type);
    if (!p.value) fail(fmt::format("a property is of unknown type \"{}\"", printable(type)));
    p.name = printable(next_word(rest));
    elements_.back().property.push_back(std::move(p));
  }

  void put_header(const Element& e, std::string& out) const {
    out += fmt::format("element {} {}\n", e.name, e.count);
    for (const Property& p : e.property) {
      const bool known = !p.name.empty() && p.name.size() <= 32 &&
                         std::all_of(p.name.begin(), p.name.end(), [](char c) {
                           return c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') ||
                                  (c >= 'A' && c <= 'Z');
                         });
      out += "property ";
      if (p.length) {
        const Type& length = coding_ == Coding::text ? kUnsigned : *p.length;
        out += fmt::format("list {} ", length.name);
      }
      out += fmt::format("{} {}\n", p.value->name, known ? p.name : "other");
    }
  }

  // Two coordinates a corner; the reader looks for the corners of all that are there.
  void check_coordinates(const Element& e, std::uint64_t item, std::uint64_t corners,
                         std::uint64_t coordinates) const {
    if (e.name != "face" || coordinates <= 2 * corners) return;
    fail(fmt::format("face {} has {} texture coordinates for {} corners, expected two for each",
                     item, coordinates, corners));
  }

  // ---- text ---------------------------------------------------------------------------------

  double number(const Element& e, std::uint64_t item, std::string_view& rest) const {
    std::string_view word = next_word(rest);
    if (word.empty()) fail(fmt::format("{} {} has too few numbers", e.name, item));
    if (word.size() > 1 && word.front() == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) {
      value = std::strtod(std::string(word).c_str(), nullptr);  // 0 or infinite, as it should be
    } else if (error != std::errc() || end != word.data() + word.size()) {
      fail(fmt::format("{} {} has \"{}\" in place of a number", e.name, item,
                       printable(word.substr(0, 40))));
    }
    return value;
  }

  void put(const Element& e, std::uint64_t item, const Type& type, double value,
           std::string& out) const {
    const auto append = [&out](const auto& x) {
      out.append(reinterpret_cast<const char*>(&x), sizeof x);
    };
    if (type.floating) {
      if (type.bytes == 8) {
        append(value);
      } else {
        append(static_cast<float>(value));
      }
      return;
    }
    const double all = std::ldexp(1.0, static_cast<int>(8 * type.bytes));
    const double least = type.is_signed ? -all / 2 : 0;
    if (!(value > least - 1 && value < least + all)) {
      fail(fmt::format("{} {} has {}, expected what is possible for {}", e.name, item, value,
                       type.name));
    }
    const auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(value));
    for (std::uint64_t i = 0; i < type.bytes; ++i) out += static_cast<char>(bits >> (8 * i) & 255);
  }

  // A line for each item; blank ones are none.
  void read_lines(Element& e, bool wanted) {
    for (std::uint64_t item = 0; item < e.count;) {
      const auto line = next_line();
      if (!line) fail(fmt::format("{} {}s after the header, expected {}", item, e.name, e.count));
      std::string_view rest = trimmed(*line);
      if (rest.empty()) continue;
      if (wanted) read_line(e, item, rest);
      ++item;
    }
  }

  void read_line(Element& e, std::uint64_t item, std::string_view rest) {
    std::uint64_t corners = 0, coordinates = 0;
    for (const Property& p : e.property) {
      std::uint64_t values = 1;
      if (p.length) {
        const double length = number(e, item, rest);
        // Each value takes a character and a blank.
        const auto room = static_cast<double>(rest.size()) / 2;
        if (!(length >= 0) || length > room) {
          too_long(e, item, static_cast<std::int64_t>(std::clamp(length, -1.0, 1e18)));
        }
        values = static_cast<std::uint64_t>(length);
        put(e, item, kUnsigned, static_cast<double>(values), e.bytes);
      }
      if (role(p) == Role::corners) corners = values;
      if (role(p) == Role::coordinates) coordinates = values;
      for (std::uint64_t i = 0; i < values; ++i) {
        put(e, item, *p.value, number(e, item, rest), e.bytes);
      }
    }
    check_coordinates(e, item, corners, coordinates);
  }

  // ---- bytes --------------------------------------------------------------------------------

  // Goes on by so many bytes.
  void take(const Element& e, std::uint64_t item, std::uint64_t count, std::uint64_t bytes) {
    std::uint64_t all = 0;
    if (!__builtin_mul_overflow(count, bytes, &all) && all <= text_.size() - at_) {
      at_ += all;
      return;
    }
    fail(fmt::format("{} bytes after the header end at {} {}, expected {} of them",
                     text_.size() - body_, e.name, item, e.count));
  }

  void read_bytes(Element& e, bool wanted) {
    at_ = std::min(at_, text_.size());
    const std::size_t begin = at_;
    if (std::none_of(e.property.begin(), e.property.end(),
                     [](const Property& p) { return p.length != nullptr; })) {
      std::uint64_t each = 0;
      for (const Property& p : e.property) each += p.value->bytes;
      take(e, each > 0 ? (text_.size() - at_) / each : 0, e.count, each);
    } else {
      for (std::uint64_t item = 0; item < e.count; ++item) skip_item(e, item);
    }
    if (wanted) e.bytes = text_.substr(begin, at_ - begin);
  }

  void skip_item(const Element& e, std::uint64_t item) {
    std::uint64_t corners = 0, coordinates = 0;
    for (const Property& p : e.property) {
      std::uint64_t values = 1;
      if (p.length) {
        take(e, item, 1, p.length->bytes);
        const std::int64_t length = length_before(at_, *p.length);
        if (length < 0 || static_cast<std::uint64_t>(length) > text_.size() - at_) {
          too_long(e, item, length);
        }
        values = static_cast<std::uint64_t>(length);
      }
      if (role(p) == Role::corners) corners = values;
      if (role(p) == Role::coordinates) coordinates = values;
      take(e, item, values, p.value->bytes);
    }
    check_coordinates(e, item, corners, coordinates);
  }

  std::int64_t length_before(std::size_t end, const Type& type) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < type.bytes; ++i) {
      const std::size_t at = coding_ == Coding::big ? end - type.bytes + i : end - 1 - i;
      value = value << 8 | static_cast<unsigned char>(text_[at]);
    }
    const std::uint64_t sign = std::uint64_t{1} << (8 * type.bytes - 1);
    if (type.is_signed && (value & sign) != 0) value |= ~(sign | (sign - 1));
    return static_cast<std::int64_t>(value);
  }

  std::string name_, text_, texture_;
  std::size_t at_ = 0, body_ = 0;  // places in text_
  bool format_ = false;
  Coding coding_ = Coding::little;
  std::vector<Element> elements_;
};

}  // namespace

std::string plain_ply(const std::filesystem::path& file) { return Reader(file).plain(); }

}  // namespace haarlight
