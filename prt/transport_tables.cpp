// Packing and checking of the row tables.

#include "prt/transport_tables.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "core/error.h"
#include "prt/packing.h"
#include "prt/transport.h"

namespace haarlight {

std::vector<std::byte> pack_tables(const RowTables& tables) {
  std::vector<std::byte> plain(tables.row_output.size() * 4 + tables.row_color.size() * 12 +
                               tables.coverage.size() * 4);
  put(put(put(plain.data(), tables.row_output), tables.row_color), tables.coverage);
  return compress_bytes(plain);
}

RowTables unpack_tables(std::span<const std::byte> packed, std::size_t rows, std::size_t outputs,
                        const std::string& name) {
  const std::size_t expected = rows * 16 + outputs * 4;
  // Padding packs well, but no more than a chunk or two of a file is padding.
  const std::vector<std::byte> plain =
      decompress_bytes(packed, expected, expected, name, "row tables");
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
