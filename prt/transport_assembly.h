// From compressed tiles to a transport file. Private to prt/.

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/progress.h"
#include "prt/journal_head.h"
#include "prt/tile_record.h"

namespace haarlight {

struct AssemblyInput {
  const JournalHead& head;
  std::string meta;
  /// The record of a tile, or null if there is none (an empty tile). Called from several threads,
  /// and more than once for a tile when the size is limited.
  std::function<std::shared_ptr<const TileRecord>(int tile)> record;
  int tiles_done = 0;  ///< traced; fewer than head.tiles: the file says that it is incomplete
  int workers = 1;     ///< chunks put together at a time
  /// In place of what the records say, where there.
  std::optional<double> measured_error{};
  std::vector<float> column_norms{};
};

/// Writes `file`; its bytes depend on head, meta and records alone. Throws Error{io}; Error{format}
/// for a record that is not of this transport; Error{invalid_argument} if nothing fits into
/// head.max_bytes; Error{cancelled}. What was under the name stays until all is written.
TransportSummary assemble_transport(const std::filesystem::path& file, const AssemblyInput& input,
                                    const Progress& progress);

/// Throws Error{invalid_argument} for sizes that no file has.
void check_info(const TransportInfo& info);

}  // namespace haarlight
