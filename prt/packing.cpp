// Arrays to bytes under zstd and back.

#include "prt/packing.h"

#include <fmt/format.h>
#include <zstd.h>

#include "core/error.h"

namespace haarlight {

std::vector<std::byte> compress_bytes(std::span<const std::byte> plain, std::size_t before) {
  std::vector<std::byte> packed(before + ZSTD_compressBound(plain.size()));
  const std::size_t size =
      ZSTD_compress(packed.data() + before, packed.size() - before, plain.data(), plain.size(), 6);
  if (ZSTD_isError(size)) {
    throw Error(ErrorKind::io, fmt::format("zstd: {}", ZSTD_getErrorName(size)));
  }
  packed.resize(before + size);
  return packed;
}

std::vector<std::byte> decompress_bytes(std::span<const std::byte> packed, std::size_t expected,
                                        std::size_t bounded, const std::string& name,
                                        const std::string& what) {
  const auto refuse = [&](const std::string& why) {
    return Error(ErrorKind::format, fmt::format("{}: {} of {} bytes does not unpack to {} bytes{}",
                                                name, what, packed.size(), expected, why));
  };
  const unsigned long long told = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (told != expected || bounded / 256 > packed.size() + (std::size_t{1} << 16)) throw refuse("");
  std::vector<std::byte> plain(expected);
  const std::size_t size =
      ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) || size != expected) {
    throw refuse(
        fmt::format(" ({})", ZSTD_isError(size) ? ZSTD_getErrorName(size) : "another size"));
  }
  return plain;
}

}  // namespace haarlight
