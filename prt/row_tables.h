// Filling the tables of a transport's rows. Private to prt/.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "prt/transport_data.h"
#include "prt/transport_tables.h"
#include "prt/transport_writer.h"

namespace haarlight {

/// The row order of a transport, black and uncovered.
RowTables empty_tables(const TransportInfo& info);

/// Colours and coverages of a tile into the tables of all rows.
void place_rows(std::size_t tile, std::span<const Rgb> color, std::span<const float> coverage,
                RowTables& tables);

std::span<const Rgb> chunk_colors(const RowTables& tables, std::size_t chunk);

/// Norms of columns from the squared norms of their parts in each chunk.
std::vector<float> norms_of(std::span<const std::vector<double>> chunk_energies,
                            std::size_t columns);

}  // namespace haarlight
