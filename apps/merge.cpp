// haarlight merge: joins the shards of one precomputation.

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/verbs.h"
#include "prt/transport_merge.h"

namespace haarlight {
namespace {

struct MergeCommand {
  std::filesystem::path output;
  std::vector<std::string> shards;

  void run() const {
    require_writable_file(output);
    ProgressPrinter progress("merge");
    const std::vector<std::filesystem::path> paths(shards.begin(), shards.end());
    const TransportSummary summary =
        merge_transport(output, paths, [&](double share) { return progress(share); });
    fmt::print("{}: {:.1f} MiB from {} shards, measured picture error {:.3g}\n", output.string(),
               static_cast<double>(summary.bytes) / (1024.0 * 1024.0), paths.size(),
               summary.measured_error);
  }
};

}  // namespace

Verb add_merge(CLI::App& verb) {
  auto command = std::make_shared<MergeCommand>();
  add_path(verb, "FILE", command->output, "FILE.hlt", "transport file to write")->required();
  verb.add_option("SHARD", command->shards, "all shards of one run, in any order")
      ->type_name("FILE.hlt.shard-i-of-n")
      ->required();
  add_threads(verb);
  verb.footer(
      "\nThe file is the same bytes that one run would have written. Shards are left as they "
      "are.\n\n"
      "Example:\n"
      "  haarlight precompute room.glb -o room.hlt --shard 1/2     (on one machine)\n"
      "  haarlight precompute room.glb -o room.hlt --shard 2/2     (on another)\n"
      "  haarlight merge room.hlt room.hlt.shard-1-of-2 room.hlt.shard-2-of-2");
  return [command] { command->run(); };
}

}  // namespace haarlight
