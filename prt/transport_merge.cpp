// Joins the shards of one run.

#include "prt/transport_merge.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/tile_journal.h"
#include "prt/transport_assembly.h"

namespace haarlight {
namespace {

using Journals = std::vector<std::unique_ptr<TileJournal>>;

[[noreturn]] void refuse(const TileJournal& journal, const std::string& what) {
  throw Error(ErrorKind::invalid_argument, fmt::format("{}: {}", journal.file().string(), what));
}

// Journals by shard: [index - 1].
Journals open_all(std::span<const std::filesystem::path> shards) {
  if (shards.empty()) {
    throw Error(ErrorKind::invalid_argument, "no shards were given, expected all of a run");
  }
  Journals opened;
  for (const std::filesystem::path& path : shards) {
    opened.push_back(std::make_unique<TileJournal>(path));
  }
  const TileJournal& first = *opened.front();
  const int count = first.head().shard.count;
  if (count < 1 || count > (1 << 20)) {
    refuse(first, fmt::format("is one of {} shards, expected 1 or more", count));
  }
  check_info(first.head().info);
  Journals ordered(static_cast<std::size_t>(count));
  for (std::unique_ptr<TileJournal>& journal : opened) {
    const Shard shard = journal->head().shard;
    if (journal.get() != &first) {
      if (!same_run(journal->head(), first.head())) {
        refuse(*journal, fmt::format("was made from another scene, view or options than {}, "
                                     "expected shards of one run",
                                     first.file().string()));
      }
    }
    if (shard.count != count || shard.index < 1 || shard.index > count) {
      refuse(*journal, fmt::format("is shard {} of {}, expected one of the {} that {} belongs to",
                                   shard.index, shard.count, count, first.file().string()));
    }
    std::unique_ptr<TileJournal>& place = ordered[static_cast<std::size_t>(shard.index - 1)];
    if (place) {
      refuse(*journal, fmt::format("is shard {} of {}, as is {}, expected each once", shard.index,
                                   count, place->file().string()));
    }
    place = std::move(journal);
  }
  return ordered;
}

void check_whole(const Journals& journals, const std::filesystem::path& file) {
  const auto count = static_cast<int>(journals.size());
  for (int i = 0; i < count; ++i) {
    const TileJournal* journal = journals[static_cast<std::size_t>(i)].get();
    if (!journal) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("{}: shard {} of {} was not given, expected all of them",
                              file.string(), i + 1, count));
    }
    const int tiles = journal->head().tiles;
    const int wanted = i < tiles ? (tiles - i - 1) / count + 1 : 0;
    const int missing = wanted - journal->count(i, count);
    if (missing > 0) {
      refuse(*journal, fmt::format("{} of its {} tiles are still to be traced, expected none: run "
                                   "its command again with --resume",
                                   missing, wanted));
    }
  }
}

}  // namespace

TransportSummary merge_transport(const std::filesystem::path& file,
                                 std::span<const std::filesystem::path> shards,
                                 const Progress& progress) {
  const Journals journals = open_all(shards);
  check_whole(journals, file);
  const JournalHead& head = journals.front()->head();
  // Tiles are there, and so their bytes; outputs are so far only a number that a head tells.
  if (head.info.output_count() > static_cast<std::size_t>(head.tiles) * kTileRows) {
    throw Error(ErrorKind::format,
                fmt::format("{}: {} outputs in {} tiles, expected at most {} in each",
                            journals.front()->file().string(), head.info.output_count(), head.tiles,
                            kTileRows));
  }
  AssemblyInput input{head, head.meta, {}, head.tiles, thread_count()};
  input.record = [&](int tile) {
    const TileJournal& journal = *journals[static_cast<std::size_t>(tile) % journals.size()];
    return std::make_shared<const TileRecord>(journal.read(tile).value());
  };
  return assemble_transport(file, input, progress);
}

}  // namespace haarlight
