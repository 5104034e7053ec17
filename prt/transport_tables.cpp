// Packing and checking of the row tables.

#include "prt/transport_tables.h"

#include <fmt/format.h>
#include <zstd.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "prt/transport.h"

namespace haarlight {
namespace {

template <typename T>
std::byte* put(std::byte* to, const std::vector<T>& values) {
  std::memcpy(to, values.data(), values.size() * sizeof(T));
  return to + values.size() * sizeof(T);
}

template <typename T>
const std::byte* take(const std::byte* from, std::vector<T>& values, std::size_t count) {
  values.resize(count);
  std::memcpy(static_cast<void*>(values.data()), from, count * sizeof(T));
  return from + count * sizeof(T);
}

}  // namespace

std::vector<std::byte> pack_tables(const RowTables& tables) {
  std::vector<std::byte> plain(tables.row_output.size() * 4 + tables.row_color.size() * 12 +
                               tables.coverage.size() * 4);
  put(put(put(plain.data(), tables.row_output), tables.row_color), tables.coverage);
  std::vector<std::byte> packed(ZSTD_compressBound(plain.size()));
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 6);
  if (ZSTD_isError(size)) {
    throw Error(ErrorKind::io, fmt::format("zstd: {}", ZSTD_getErrorName(size)));
  }
  packed.resize(size);
  return packed;
}

RowTables unpack_tables(std::span<const std::byte> packed, std::size_t rows, std::size_t outputs,
                        const std::string& name) {
  const std::size_t expected = rows * 16 + outputs * 4;
  std::vector<std::byte> plain(expected);
  const std::size_t size =
      ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) || size != expected) {
    throw Error(ErrorKind::format,
                fmt::format("{}: row tables do not unpack to {} bytes ({})", name, expected,
                            ZSTD_isError(size) ? ZSTD_getErrorName(size) : "another size"));
  }
  RowTables tables;
  const std::byte* from = take(plain.data(), tables.row_output, rows);
  take(take(from, tables.row_color, rows), tables.coverage, outputs);
  std::vector<bool> used(outputs, false);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::uint32_t output = tables.row_output[row];
    if (!is_finite(tables.row_color[row])) {
      throw Error(ErrorKind::format, fmt::format("{}: colour of row {} is not finite", name, row));
    }
    if (output == kNoOutput) continue;
    if (output >= outputs || used[output]) {
      throw Error(
          ErrorKind::format,
          fmt::format("{}: row {} goes to output {}, expected one below {} that no other row "
                      "goes to",
                      name, row, output, outputs));
    }
    used[output] = true;
  }
  for (float c : tables.coverage) {
    if (!(c >= 0 && c <= 1)) {
      throw Error(ErrorKind::format, fmt::format("{}: a coverage of {}, expected 0 to 1", name, c));
    }
  }
  return tables;
}

}  // namespace haarlight
