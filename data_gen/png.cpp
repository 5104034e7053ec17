// Small pictures with holes as PNG in memory.

#include "data_gen/png.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace haarlight::data_gen {
namespace {

void append_u32(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xff);
}

std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
  }
  return ~crc;
}

std::uint32_t adler32(std::string_view bytes) {
  std::uint32_t a = 1, b = 0;
  for (const char c : bytes) {
    a = (a + static_cast<unsigned char>(c)) % 65521;
    b = (b + a) % 65521;
  }
  return b << 16 | a;
}

void append_chunk(std::string& out, const std::string& type, const std::string& data) {
  append_u32(out, static_cast<std::uint32_t>(data.size()));
  out += type + data;
  append_u32(out, crc32(type + data));
}

// zlib's frame around blocks that are copied as they are.
std::string stored(std::string_view bytes) {
  constexpr std::size_t kLongest = 65535;
  std::string out{'\x78', '\x01'};
  for (std::size_t at = 0; at < bytes.size(); at += kLongest) {
    const std::size_t size = std::min(kLongest, bytes.size() - at);
    out += at + size == bytes.size() ? '\x01' : '\0';
    for (const std::size_t value : {size, ~size}) {
      out += static_cast<char>(value & 0xff);
      out += static_cast<char>(value >> 8 & 0xff);
    }
    out += bytes.substr(at, size);
  }
  append_u32(out, adler32(bytes));
  return out;
}

char byte_of(float value, bool srgb) {
  double c = std::clamp(static_cast<double>(value), 0.0, 1.0);
  if (srgb) c = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
  return static_cast<char>(std::lround(255 * c));
}

}  // namespace

std::string encode_png(const Image& image, const std::vector<float>& alpha, bool srgb) {
  std::string rows;
  for (int y = 0; y < image.height; ++y) {
    rows += '\0';  // no filter
    for (int x = 0; x < image.width; ++x) {
      const Rgb& c = image.at(x, y);
      for (const float channel : {c.r, c.g, c.b}) rows += byte_of(channel, srgb);
      rows += byte_of(alpha.empty() ? 1.0f : alpha[image.index(x, y)], false);
    }
  }
  std::string header;
  append_u32(header, static_cast<std::uint32_t>(image.width));
  append_u32(header, static_cast<std::uint32_t>(image.height));
  header +=
      {'\x08', '\x06', '\0', '\0', '\0'};  // 8 bits; RGBA; the only compression, filter, order
  std::string out = "\x89PNG\r\n\x1a\n";
  append_chunk(out, "IHDR", header);
  append_chunk(out, "IDAT", stored(rows));
  append_chunk(out, "IEND", "");
  return out;
}

}  // namespace haarlight::data_gen
