// What a Transport holds; private to prt/.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "prt/transport.h"

namespace haarlight {

struct Transport::Data {
  explicit Data(int face_size) : layout(face_size) {}

  HaarLayout layout;
  TransportInfo info;
  std::vector<std::span<const std::byte>> chunks;
  std::shared_ptr<const void> storage;  ///< keeps the bytes of `chunks` alive: a mapping or buffers
  std::vector<std::uint32_t> row_output;
  std::vector<Rgb> row_color;
  std::vector<float> coverage;
  std::vector<float> column_norms;
  std::uint64_t chunk_bytes = 0, file_bytes = 0;
};

/// Squared L2 norms of the columns of a chunk, colours applied; one a coefficient, added to `sums`.
/// `color` is the chunk's kChunkRows rows.
void add_column_energies(const HaarLayout& layout, std::span<const std::byte> chunk,
                         std::span<const Rgb> color, std::span<double> sums);

}  // namespace haarlight
