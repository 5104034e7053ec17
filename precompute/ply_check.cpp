// Whether a PLY file holds as much as its header promises.

#include "precompute/ply_check.h"

#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include "core/error.h"

namespace haarlight {
namespace {

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

std::uint64_t saturating_product(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  return __builtin_mul_overflow(a, b, &product) ? std::numeric_limits<std::uint64_t>::max() / 4
                                                : product;
}

}  // namespace

void check_ply_length(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw Error(ErrorKind::io, fmt::format("{}: cannot be opened for reading", file.string()));
  }
  bool text = false, ended = false;
  std::uint64_t lines = 0, bytes = 0;  // promised
  std::uint64_t count = 0;             // of the element being described
  std::string line;
  while (!ended && std::getline(in, line)) {
    std::istringstream words(line);
    std::string word, type;
    words >> word;
    if (word == "format") {
      words >> type;
      text = type == "ascii";
    } else if (word == "element") {
      words >> type >> count;
      lines += std::min(count, std::numeric_limits<std::uint64_t>::max() / 4);
    } else if (word == "property") {
      words >> type;
      if (type == "list") {  // at least its length, and three corners if it is a face
        std::string length, item, name;
        words >> length >> item >> name;
        const std::uint64_t least = name.starts_with("vertex_ind") ? 3 * type_bytes(item) : 0;
        bytes += saturating_product(count, type_bytes(length) + least);
      } else {
        bytes += saturating_product(count, type_bytes(type));
      }
    } else if (word == "end_header") {
      ended = true;
    }
  }
  if (!ended) {
    throw Error(ErrorKind::format,
                fmt::format("{}: the PLY header has no end, expected end_header", file.string()));
  }
  if (text) {
    std::uint64_t found = 0;
    while (found < lines && std::getline(in, line)) {
      if (line.find_first_not_of(" \t\r") != std::string::npos) ++found;
    }
    if (found < lines) {
      throw Error(ErrorKind::format, fmt::format("{}: {} lines after the header, expected {}",
                                                 file.string(), found, lines));
    }
    return;
  }
  const auto header = static_cast<std::uint64_t>(in.tellg());
  const std::uint64_t found = std::filesystem::file_size(file) - header;
  if (found < bytes) {
    throw Error(ErrorKind::format, fmt::format("{}: {} bytes after the header, expected {} or more",
                                               file.string(), found, bytes));
  }
}

}  // namespace haarlight
