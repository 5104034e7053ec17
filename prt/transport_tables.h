// The small per-row tables of a transport, compressed with zstd. Private to prt/.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/rgb.h"

namespace haarlight {

/// Stored one after the other: row_output (u32 a row), row_color (3 floats a row), coverage (a
/// float an output).
struct RowTables {
  std::vector<std::uint32_t> row_output;
  std::vector<Rgb> row_color;
  std::vector<float> coverage;
};

std::vector<std::byte> pack_tables(const RowTables& tables);

/// Throws Error{format}, message beginning with `name`, unless the bytes unpack to exactly `rows`
/// rows and `outputs` outputs with every output in range and used by at most one row.
RowTables unpack_tables(std::span<const std::byte> packed, std::size_t rows, std::size_t outputs,
                        const std::string& name);

}  // namespace haarlight
