// haarlight info: checks a transport file and says what is in it.

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/option_parsers.h"
#include "apps/verbs.h"
#include "precompute/scene_files.h"
#include "prt/completeness.h"
#include "prt/transport.h"

namespace haarlight {
namespace {

using Json = nlohmann::ordered_json;

struct ColumnSizes {
  std::uint64_t least = 0, median = 0, most = 0;
  double mean = 0;
};

ColumnSizes column_sizes(const Transport& transport) {
  std::vector<std::uint64_t> bytes;
  double sum = 0;
  for (int j = 0; j < transport.layout().size(); ++j) {
    bytes.push_back(transport.column_bytes(j));
    sum += static_cast<double>(bytes.back());
  }
  std::sort(bytes.begin(), bytes.end());
  return {bytes.front(), bytes[bytes.size() / 2], bytes.back(),
          sum / static_cast<double>(bytes.size())};
}

/// How the file was made. A file of another program may hold anything here.
Json parse_meta(const std::string& meta) {
  Json parsed = Json::parse(meta, nullptr, false);
  return parsed.is_object() ? parsed : Json::object();
}

/// "unchanged", "changed", "not found" or "not known": whether the scene beside the file is still
/// the one that it was made from.
std::string scene_state_of(const std::filesystem::path& file, const Json& made) {
  const auto text = [&](const char* key) {
    return made.contains(key) && made[key].is_string() ? made[key].get<std::string>()
                                                       : std::string();
  };
  if (text("scene_path").empty() || text("scene_hash").empty()) return "not known";
  switch (scene_state(file, text("scene_path"), text("scene_hash"))) {
    case SceneState::same:
      return "unchanged";
    case SceneState::changed:
      return "changed";
    case SceneState::not_found:
      break;
  }
  return "not found";
}

Json describe_clusters(const TransportInfo& info) {
  const ClusterWeights& w = *info.clusters;
  std::vector<std::uint32_t> vertices, vectors;
  for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
    vertices.push_back(w.vertices_of(c));
    vectors.push_back(w.vectors_of(c));
  }
  const auto [fewest_vertices, most_vertices] =
      std::minmax_element(vertices.begin(), vertices.end());
  const auto [fewest, most] = std::minmax_element(vectors.begin(), vectors.end());
  return {{"count", w.clusters()},
          {"vertices", {{"min", *fewest_vertices}, {"max", *most_vertices}}},
          {"vectors", {{"min", *fewest}, {"max", *most}, {"sum", w.vectors()}}},
          {"weight_bits", w.bits},
          {"weight_bytes", w.weight.size() * static_cast<std::size_t>(w.bits) / 8},
          {"tinted", !w.tint.empty()}};
}

Json describe(const std::filesystem::path& file, const Transport& transport) {
  const TransportInfo& info = transport.info();
  const ColumnSizes columns = column_sizes(transport);
  const Vec3& position = info.camera.position;
  const Vec3 forward = info.camera.orientation * Vec3{0, 0, -1};

  Json bands = Json::array();
  for (int b = 0; b < transport.layout().band_count(); ++b) {
    std::uint64_t bytes = 0;
    const IndexRange range = transport.layout().band(b);
    for (int j = range.begin; j < range.end; ++j) bytes += transport.column_bytes(j);
    bands.push_back({{"area_texels", transport.layout().area(b)},
                     {"wavelets", range.size()},
                     {"bytes", bytes}});
  }

  const std::span<const float> coverage = transport.coverage();
  const auto covered =
      std::count_if(coverage.begin(), coverage.end(), [](float share) { return share > 0; });
  const std::span<const std::uint32_t> outputs = transport.row_output();
  const auto rows = std::count_if(outputs.begin(), outputs.end(),
                                  [](std::uint32_t output) { return output != kNoOutput; });

  Json out;
  out["file"] = file.string();
  out["file_bytes"] = transport.file_bytes();
  out["chunk_bytes"] = transport.chunk_bytes();
  out["kind"] = info.clusters ? "clusters" : info.mesh ? "mesh" : "image";
  if (info.mesh) {
    out["vertices"] = info.mesh->position.size();
    out["triangles"] = info.mesh->triangle.size();
    out["terms"] = info.terms;
    if (info.view) {
      int most = 0;
      for (const int order : info.view->order) most = std::max(most, std::abs(order));
      out["view_factors"] = {
          {"sets", info.view->sets()}, {"samples", info.view->resolution}, {"most_order", most}};
    }
  }
  if (info.clusters) out["clusters"] = describe_clusters(info);
  out["face_size"] = info.face_size;
  out["coefficients"] = transport.layout().size();
  out["width"] = info.width;
  out["height"] = info.height;
  out["rows"] = rows;
  out["rows_stored"] = transport.rows();
  if (!info.mesh) out["pixels_covered"] = covered;
  out["camera"] = {{"position_m", {position.x, position.y, position.z}},
                   {"forward", {forward.x, forward.y, forward.z}},
                   {"vertical_fov_degrees", info.camera.vertical_fov * 180 / kPi}};
  out["column_bytes"] = {{"min", columns.least},
                         {"median", columns.median},
                         {"mean", columns.mean},
                         {"max", columns.most}};
  out["bands"] = bands;
  out["complete"] = incomplete_note(info.meta).empty();
  out["scene"] = scene_state_of(file, parse_meta(info.meta));
  out["checksums"] = "verified";  // Transport::open throws when one is wrong
  out["made"] = parse_meta(info.meta);
  return out;
}

std::string mebibytes(double bytes) { return fmt::format("{:.2f} MiB", bytes / (1024.0 * 1024.0)); }
std::string kibibytes(double bytes) { return fmt::format("{:.1f} KiB", bytes / 1024.0); }

// Which effects are in, and what the plan said of each, if there was one.
void print_effects(const Json& made) {
  if (made.contains("effects") && made["effects"].is_string()) {
    fmt::print("{:<22}{}\n", "effects", made["effects"].get<std::string>());
  }
  if (!made.contains("plan") || !made["plan"].is_object()) return;
  for (const Json& row : made["plan"].value("rows", Json::array())) {
    if (!row.is_object()) continue;
    const std::string effect = row.value("effect", std::string());
    const std::string why = row.value("why", std::string());
    fmt::print("{:<22}{}: {}{}\n", "  plan", effect,
               row.value("needed", false) ? "needed; " : "not needed; ", why);
  }
}

// Of a compressed transport: what it was made from.
void print_source(const Json& source) {
  if (!source.is_object() || !source.contains("file_bytes") || !source["file_bytes"].is_number()) {
    return;
  }
  std::string error;
  if (source.contains("measured_error") && source["measured_error"].is_number()) {
    error = fmt::format(", itself with an error of {:.3g}", source["measured_error"].get<double>());
  }
  fmt::print("{:<22}{}{}\n", "compressed from", mebibytes(source["file_bytes"].get<double>()),
             error);
}

void print_text(const Json& d) {
  const auto line = [](const std::string& name, const std::string& value) {
    fmt::print("{:<21} {}\n", name, value);
  };
  line("file", fmt::format("{}, {}", d["file"].get<std::string>(), mebibytes(d["file_bytes"])));
  const bool mesh = d["kind"] != "image";
  if (mesh) {
    line("mesh", fmt::format("{} vertices, {} triangles, {} term{} a vertex; shown at {}x{} pixels",
                             d["vertices"].get<std::int64_t>(), d["triangles"].get<std::int64_t>(),
                             d["terms"].get<int>(), d["terms"] == 1 ? "" : "s",
                             d["width"].get<int>(), d["height"].get<int>()));
    if (d.contains("view_factors")) {
      const Json& view = d["view_factors"];
      line("view factors",
           fmt::format("{} set{} of {} terms, {} samples each, orders up to {}",
                       view["sets"].get<int>(), view["sets"] == 1 ? "" : "s", d["terms"].get<int>(),
                       view["samples"].get<int>(), view["most_order"].get<int>()));
    }
    if (d["made"].contains("terms") && d["made"]["terms"].is_object()) {
      for (const Json& m : d["made"]["terms"].value("materials", Json::array())) {
        if (!m.is_object()) continue;
        line("  " + m.value("name", std::string("?")),
             fmt::format("{} term{}; {:.2g} of the BRDF is left out", m.value("terms", 0),
                         m.value("terms", 0) == 1 ? "" : "s", m.value("error", 0.0)));
      }
    }
  } else {
    line("picture", fmt::format("{}x{} pixels, {} of them show the scene", d["width"].get<int>(),
                                d["height"].get<int>(), d["pixels_covered"].get<std::int64_t>()));
  }
  if (d.contains("clusters")) {
    const Json& c = d["clusters"];
    line("clusters",
         fmt::format("{} of {} to {} vertices, with {} to {} vectors, {} together; weights of {} "
                     "bits, {}{}",
                     c["count"].get<int>(), c["vertices"]["min"].get<int>(),
                     c["vertices"]["max"].get<int>(), c["vectors"]["min"].get<int>(),
                     c["vectors"]["max"].get<int>(), c["vectors"]["sum"].get<int>(),
                     c["weight_bits"].get<int>(), mebibytes(c["weight_bytes"]),
                     c["tinted"].get<bool>() ? "; vertices have colours of their own" : ""));
  }
  line("lighting", fmt::format("6x{0}x{0} texels, {1} coefficients", d["face_size"].get<int>(),
                               d["coefficients"].get<int>()));
  const Json& camera = d["camera"];
  line("camera",
       fmt::format("at ({:.4g}, {:.4g}, {:.4g}) m, towards ({:.3f}, {:.3f}, {:.3f}), "
                   "vertical field of view {:.2f} degrees",
                   camera["position_m"][0].get<double>(), camera["position_m"][1].get<double>(),
                   camera["position_m"][2].get<double>(), camera["forward"][0].get<double>(),
                   camera["forward"][1].get<double>(), camera["forward"][2].get<double>(),
                   camera["vertical_fov_degrees"].get<double>()));
  line("rows", fmt::format("{} {} in {} stored rows", d["rows"].get<std::int64_t>(),
                           d.contains("clusters") ? "vector terms"
                           : mesh                 ? "vertex terms"
                                                  : "pixels",
                           d["rows_stored"].get<int>()));
  const Json& columns = d["column_bytes"];
  line("columns", fmt::format("{} together; one is {} in the mean, {} to {}, median {}",
                              mebibytes(d["chunk_bytes"]), kibibytes(columns["mean"]),
                              kibibytes(columns["min"]), kibibytes(columns["max"]),
                              kibibytes(columns["median"])));
  int band = 0;
  for (const Json& b : d["bands"]) {
    line(fmt::format("  band {}", band++),
         fmt::format("{:>6} wavelets of {:>4} texels, {}", b["wavelets"].get<int>(),
                     b["area_texels"].get<int>(), mebibytes(b["bytes"])));
  }
  if (d["made"].contains("measured_error") && d["made"]["measured_error"].is_number()) {
    line("measured error",
         fmt::format("{:.3g} of the picture, relative RMSE, worst of the built-in lightings",
                     d["made"]["measured_error"].get<double>()));
  }
  if (!d["complete"].get<bool>()) line("incomplete", incomplete_note(d["made"].dump()));
  const std::string scene = d["scene"].get<std::string>();
  if (scene == "changed") {
    line("scene", "changed since: precompute again to have it shown as it is now");
  } else if (scene != "not known") {
    line("scene", scene == "unchanged" ? "unchanged since" : "not found beside the file");
  }
  line("checksums", "verified, every byte");
  print_effects(d["made"]);
  for (const auto& [key, value] : d["made"].items()) {
    if (key == "measured_error" || key == "effects" || key == "plan" || key == "terms") continue;
    if (key == "compressed" && value.is_object() && value.contains("source")) {
      print_source(value["source"]);
    }
    line("made: " + key, value.dump());
  }
}

struct InfoCommand {
  std::filesystem::path file;
  bool json = false;

  void run() const {
    const Json description = describe(file, Transport::open(file));
    if (json) {
      fmt::print("{}\n", description.dump(2));
    } else {
      print_text(description);
    }
  }
};

}  // namespace

Verb add_info(CLI::App& verb) {
  auto command = std::make_shared<InfoCommand>();
  add_path(verb, "FILE", command->file, "FILE.hlt", "transport file")->required();
  verb.add_flag("--json", command->json, "print JSON; sizes in bytes, lengths in metres");
  verb.footer(
      "\nEvery byte is checked first: a damaged file is refused with what is wrong.\n\n"
      "Example:\n  haarlight info bunny.hlt --json");
  return [command] { command->run(); };
}

}  // namespace haarlight
