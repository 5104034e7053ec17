// Filling the tables of a transport's rows.

#include "prt/row_tables.h"

#include <cmath>

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);

}  // namespace

void place_rows(std::size_t tile, std::span<const Rgb> color, std::span<const float> coverage,
                RowTables& tables) {
  for (std::size_t r = 0; r < kRows; ++r) {
    const std::uint32_t output = tables.row_output[tile * kRows + r];
    tables.row_color[tile * kRows + r] = color[r];
    if (output != kNoOutput) tables.coverage[output] = coverage[r];
  }
}

RowTables empty_tables(const TransportInfo& info) {
  RowTables tables;
  tables.row_output = row_order(info);
  tables.row_color.assign(tables.row_output.size(), Rgb{});
  tables.coverage.assign(info.output_count(), 0.0f);
  return tables;
}

std::vector<float> norms_of(std::span<const std::vector<double>> chunk_energies,
                            std::size_t columns) {
  std::vector<float> norms(columns);
  for (std::size_t j = 0; j < columns; ++j) {
    double sum = 0;
    for (const auto& energies : chunk_energies) sum += energies[j];
    norms[j] = static_cast<float>(std::sqrt(sum));
  }
  return norms;
}

std::span<const Rgb> chunk_colors(const RowTables& tables, std::size_t chunk) {
  return std::span(tables.row_color).subspan(chunk * kChunkRows, kChunkRows);
}

}  // namespace haarlight
