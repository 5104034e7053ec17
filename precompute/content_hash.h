// Hashes plain values, for fingerprints of scenes and options.

#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <type_traits>
#include <vector>

#include "core/image.h"
#include "core/rgb.h"
#include "core/vec.h"

struct XXH3_state_s;

namespace haarlight {

/// XXH3, 128 bits. Structs go in field by field so that padding never counts.
class ContentHash {
 public:
  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;

  template <typename T>
  requires std::is_arithmetic_v<T>
  void add(T value) { add_bytes(&value, sizeof value); }
  void add(const Vec3& v) { add(v.x), add(v.y), add(v.z); }
  void add(const Rgb& c) { add(c.r), add(c.g), add(c.b); }
  void add(const std::array<float, 2>& v) { add(v[0]), add(v[1]); }
  void add(const Image& i) { add(i.width), add(i.height), add_all(i.pixels); }
  void add(const std::string& text) { add(text.size()), add_bytes(text.data(), text.size()); }
  template <typename T>
  void add_all(const std::vector<T>& values) {
    add(values.size());
    for (const T& v : values) add(v);
  }
  void add_bytes(const void* bytes, std::size_t size);

  std::string text() const;  ///< 32 hexadecimal digits

 private:
  XXH3_state_s* state_;
};

}  // namespace haarlight
