// The JSON and the buffers of a glTF file.

#include "caching/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "core/error.h"
#include "core/input_file.h"
#include "core/json_depth.h"

namespace haarlight {
namespace {

std::vector<std::uint8_t> read_all(const std::filesystem::path& file) {
  const InputFile in(file);
  std::vector<std::uint8_t> bytes(in.size());
  in.read(0, std::as_writable_bytes(std::span(bytes)));
  return bytes;
}

std::uint32_t word_at(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  std::uint32_t word = 0;
  if (at + sizeof word <= bytes.size()) std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

int base64_digit(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

std::vector<std::uint8_t> decode_base64(const std::string& text, std::size_t begin) {
  std::vector<std::uint8_t> bytes;
  unsigned bits = 0;
  int count = 0;
  for (std::size_t i = begin; i < text.size(); ++i) {
    const int digit = base64_digit(text[i]);
    if (digit < 0) continue;
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffffffu;
    if (++count % 4 == 1) continue;
    bytes.push_back(static_cast<std::uint8_t>(bits >> (count % 4 == 2   ? 4
                                                       : count % 4 == 3 ? 2
                                                                        : 0)));
  }
  return bytes;
}

struct ComponentType {
  int code;
  std::size_t bytes;
  double largest;  // of a normalised integer
  bool is_signed;
};
constexpr ComponentType kTypes[] = {{5120, 1, 127, true},         {5121, 1, 255, false},
                                    {5122, 2, 32767, true},       {5123, 2, 65535, false},
                                    {5125, 4, 4294967295, false}, {5126, 4, 0, true}};

double number_at(const std::uint8_t* at, const ComponentType& type) {
  if (type.code == 5126) {
    float value = 0;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }
  std::uint32_t bits = 0;
  std::memcpy(&bits, at, type.bytes);
  if (!type.is_signed) return bits;
  return type.bytes == 1 ? static_cast<double>(static_cast<std::int8_t>(bits))
                         : static_cast<double>(static_cast<std::int16_t>(bits));
}

}  // namespace

GltfDocument::GltfDocument(const std::filesystem::path& file) : name_(file.string()) {
  std::vector<std::uint8_t> bytes = read_all(file);
  std::string text(bytes.begin(), bytes.end());
  std::vector<std::uint8_t> chunk;
  if (text.starts_with("glTF")) {  // glTF 2.0, section 4.4
    constexpr std::size_t kHead = 12, kChunkHead = 8;
    const std::size_t json_size = word_at(bytes, kHead);
    if (bytes.size() < kHead + kChunkHead || json_size > bytes.size() - kHead - kChunkHead) {
      throw Error(ErrorKind::format, fmt::format("{}: cut short, expected a whole GLB", name_));
    }
    text = text.substr(kHead + kChunkHead, json_size);
    const std::size_t next = kHead + kChunkHead + (json_size + 3) / 4 * 4;
    if (next + kChunkHead <= bytes.size()) {
      const std::size_t size =
          std::min<std::size_t>(word_at(bytes, next), bytes.size() - next - kChunkHead);
      const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(next + kChunkHead);
      chunk.assign(from, from + static_cast<std::ptrdiff_t>(size));
    }
  }
  try {
    if (json_nests_too_deep(text)) {
      throw Error(ErrorKind::format, fmt::format("{}: its JSON nests deeper than {}, expected "
                                                 "glTF 2.0",
                                                 name_, kMostJsonDepth));
    }
    json_ = nlohmann::json::parse(text);
    for (const auto& entry : list("buffers")) {
      const auto wanted = entry.at("byteLength").get<std::size_t>();
      const std::string uri = entry.value("uri", std::string());
      std::vector<std::uint8_t> data;
      if (uri.empty()) {
        data = chunk;
      } else if (uri.starts_with("data:")) {
        const std::size_t comma = uri.find(',');
        if (comma != std::string::npos) data = decode_base64(uri, comma + 1);
      } else {
        data = read_all(file.parent_path() / uri);
      }
      if (data.size() < wanted) {
        throw Error(ErrorKind::format, fmt::format("{}: buffer {} has {} bytes, expected {}", name_,
                                                   buffer_.size(), data.size(), wanted));
      }
      buffer_.push_back(std::move(data));
    }
  } catch (const nlohmann::json::exception&) {
    throw Error(ErrorKind::format,
                fmt::format("{}: not readable as glTF, expected the JSON of glTF 2.0", name_));
  }
}

const nlohmann::json& GltfDocument::list(const char* key) const {
  static const nlohmann::json kNone = nlohmann::json::array();
  return json_.contains(key) && json_.at(key).is_array() ? json_.at(key) : kNone;
}

std::vector<double> GltfDocument::numbers(std::size_t accessor, std::size_t width) const {
  const auto refuse = [&](const char* wanted) {
    throw Error(ErrorKind::format, fmt::format("{}: accessor {} {}", name_, accessor, wanted));
  };
  try {
    if (accessor >= list("accessors").size()) refuse("is not there");
    const auto& a = list("accessors").at(accessor);
    const auto code = a.at("componentType").get<int>();
    const auto* type = std::find_if(std::begin(kTypes), std::end(kTypes),
                                    [&](const ComponentType& t) { return t.code == code; });
    if (type == std::end(kTypes)) refuse("has an unknown component type");
    if (a.contains("sparse")) refuse("is sparse, expected all of its numbers in a row");
    static const std::pair<const char*, std::size_t> kWidths[] = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
    const auto kind = a.at("type").get<std::string>();
    if (std::none_of(std::begin(kWidths), std::end(kWidths),
                     [&](const auto& w) { return kind == w.first && width == w.second; })) {
      refuse("has another shape than its use wants");
    }
    const auto count = a.at("count").get<std::size_t>();
    const auto& view = list("bufferViews").at(a.at("bufferView").get<std::size_t>());
    const auto& data = buffer_.at(view.at("buffer").get<std::size_t>());
    const std::size_t element = width * type->bytes;
    const std::size_t stride = std::max(view.value("byteStride", std::size_t{0}), element);
    const std::size_t begin =
        view.value("byteOffset", std::size_t{0}) + a.value("byteOffset", std::size_t{0});
    // Division, so that no product wraps.
    if (begin > data.size() || stride > data.size() || count > data.size() ||
        (count > 0 &&
         (data.size() - begin < element || count - 1 > (data.size() - begin - element) / stride))) {
      refuse("reaches past the end of its buffer");
    }
    const bool normalized = a.value("normalized", false) && type->largest > 0;
    std::vector<double> out;
    out.reserve(count * width);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < width; ++k) {
        double value = number_at(data.data() + begin + i * stride + k * type->bytes, *type);
        if (normalized) value = std::max(value / type->largest, -1.0);
        if (!std::isfinite(value)) refuse("has a number that is not finite");
        out.push_back(value);
      }
    }
    return out;
  } catch (const nlohmann::json::exception&) {
    refuse("is not as glTF 2.0 has it");
  } catch (const std::out_of_range&) {
    refuse("names a buffer that is not there");
  }
  return {};
}

}  // namespace haarlight
