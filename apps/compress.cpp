// haarlight compress: a mesh's transport in clusters (clustered PCA).

#include "cpca/compress.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/verbs.h"
#include "core/error.h"
#include "prt/completeness.h"

namespace haarlight {
namespace {

constexpr int kMostClustersAsked = 1 << 20;

struct CompressCommand {
  std::filesystem::path file, output;
  CompressOptions options;

  void run() const;
};

/// The transport's description with the way to its scene from where the new file is.
std::string meta_beside(const std::string& meta, const std::filesystem::path& from,
                        const std::filesystem::path& to) {
  nlohmann::json made = nlohmann::json::parse(meta, nullptr, false);
  if (!made.is_object()) return "{}";
  if (made.contains("scene_path") && made["scene_path"].is_string()) {
    const auto folder = [](const std::filesystem::path& file) {
      return std::filesystem::absolute(file).lexically_normal().parent_path();
    };
    const std::filesystem::path scene = folder(from) / made["scene_path"].get<std::string>();
    made["scene_path"] = scene.lexically_normal().lexically_relative(folder(to)).string();
  }
  return made.dump(2);
}

void CompressCommand::run() const {
  const Transport transport = Transport::open(file);
  if (transport.kind() != TransportKind::mesh) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: {}, expected the transport of a mesh's vertices, as precompute "
                            "--vertices makes it",
                            file.string(),
                            transport.kind() == TransportKind::image ? "the transport of one view"
                                                                     : "compressed already"));
  }
  const std::size_t vertices = transport.info().mesh->position.size();
  if (options.clusters > 0 && static_cast<std::size_t>(options.clusters) > vertices) {
    refuse_option("--clusters", fmt::format("{}", options.clusters),
                  fmt::format("at most one a vertex, {}", vertices));
  }
  require_writable_file(output);
  const std::string note = incomplete_note(transport.info().meta);
  if (!note.empty()) fmt::print(stderr, "{}: incomplete: {}\n", file.string(), note);

  ProgressPrinter progress("compress");
  CompressOptions all = options;
  all.meta = meta_beside(transport.info().meta, file, output);
  const CompressReport report =
      compress_transport(transport, output, all, [&](double share) { return progress(share); });
  fmt::print(
      "{}: {} clusters of {:.1f} vectors in the mean, {:.1f} MiB, {:.1f} times smaller, measured "
      "picture error {:.3g}\n",
      output.string(), report.clusters, static_cast<double>(report.vectors) / report.clusters,
      static_cast<double>(report.bytes) / (1024.0 * 1024.0),
      static_cast<double>(transport.file_bytes()) / static_cast<double>(report.bytes),
      report.measured_error);
  if (options.basis == 0 && report.measured_error > options.error) {
    fmt::print(stderr, "{}: measured error {:.3g}, wanted {:.3g}: more --clusters are needed\n",
               output.string(), report.measured_error, options.error);
  }
}

}  // namespace

Verb add_compress(CLI::App& verb) {
  auto command = std::make_shared<CompressCommand>();
  CompressCommand& c = *command;
  add_path(verb, "FILE", c.file, "FILE.hlt", "transport of a mesh, made with --vertices")
      ->required();
  add_path(verb, "-o,--output", c.output, "OUT.hlt", "file to write")->required();
  add_number(verb, "--error", c.options.error, 1e-6, 0.999,
             "most picture error, relative RMSE against FILE under the worst built-in lighting; "
             "with --basis half of it is for entries that are dropped, and the basis leaves what "
             "it leaves");
  verb.add_option_function<std::string>(
          "--clusters",
          [&c](const std::string& text) {
            c.options.clusters = 0;
            if (text == "auto") return;
            c.options.clusters = parse_integer("--clusters", text, 1, kMostClustersAsked);
          },
          "groups of vertices with vectors of their own; auto: of one per 400, 200, 100 or 50 "
          "vertices the fewest whose file is within 5 % of the smallest; where none reaches "
          "--error, what comes nearest [auto]")
      ->type_name("auto|N");
  verb.add_option_function<std::string>(
          "--basis",
          [&c](const std::string& text) {
            c.options.basis = 0;
            if (text == "auto") return;
            c.options.basis = parse_integer("--basis", text, 1, kMostVectors);
          },
          fmt::format(
              "vectors a cluster, 1 to {}; auto: as many as --error wants, each cluster its "
              "own number [auto]",
              kMostVectors))
      ->type_name("auto|S");
  add_choice<int>(verb, "--weight-bits", c.options.bits, {{"8", 8}, {"16", 16}},
                  "of a vertex's weight of a vector");
  add_integer(verb, "--iterations", c.options.iterations, 0, 1000,
              "most rounds in which vertices change clusters");
  add_threads(verb);
  verb.footer(
      "\nClustered PCA: vertices that see light alike share a few vectors of transport, of which\n"
      "each keeps its own weights. The file takes a fraction of the bytes and relights faster:\n"
      "relight, info and haarlight-view read it as any other, from all sides. The measured error "
      "is\n"
      "printed and kept in the file; the error that FILE itself has comes on top.\n\n"
      "Examples:\n"
      "  haarlight precompute street.glb --vertices -o street.hlt\n"
      "  haarlight compress street.hlt -o small.hlt --error 0.02\n"
      "  haarlight compress street.hlt -o small.hlt --clusters 398 --basis 25");
  return [command] { command->run(); };
}

}  // namespace haarlight
