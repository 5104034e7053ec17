// Arrays to bytes under zstd and back, sizes checked first. Private to prt/.

#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace haarlight {

/// Writes the bytes of `values` at `to` and returns their end.
template <typename T>
std::byte* put(std::byte* to, const std::vector<T>& values) {
  if (!values.empty()) std::memcpy(to, values.data(), values.size() * sizeof(T));
  return to + values.size() * sizeof(T);
}

/// Reads `count` values at `from` and returns their end.
template <typename T>
const std::byte* take(const std::byte* from, std::vector<T>& values, std::size_t count) {
  values.resize(count);
  if (count > 0) std::memcpy(static_cast<void*>(values.data()), from, count * sizeof(T));
  return from + count * sizeof(T);
}

/// One zstd frame, behind `before` untouched bytes.
std::vector<std::byte> compress_bytes(std::span<const std::byte> plain, std::size_t before = 0);

/// Throws Error{format}, "NAME: WHAT does not unpack to ...", unless `packed` is a frame of exactly
/// `expected` bytes. A frame tells its size before anything is asked for; `bounded` of the expected
/// bytes must not be more than 256 times what is brought, so that a crafted frame cannot ask for
/// more than a multiple of that.
std::vector<std::byte> decompress_bytes(std::span<const std::byte> packed, std::size_t expected,
                                        std::size_t bounded, const std::string& name,
                                        const std::string& what);

}  // namespace haarlight
