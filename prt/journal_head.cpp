// What a journal of tiles says of itself at its beginning.

#include "prt/journal_head.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "core/json_depth.h"
#include "prt/transport_assembly.h"
#include "prt/transport_format.h"

namespace haarlight {
namespace {

constexpr char kJournalMagic[8] = {'H', 'l', 't', 'j', 'r', 'n', '0', '3'};

struct FixedHead {
  char magic[8];
  std::uint64_t text, rest;  ///< bytes of the two parts that follow
  std::uint64_t hash;        ///< XXH3 of both
};
static_assert(sizeof(FixedHead) == kHeadFixedBytes);

nlohmann::json camera_json(const Camera& camera) {
  nlohmann::json rows = nlohmann::json::array();
  for (const Vec3& r : camera.orientation.row) rows.push_back({r.x, r.y, r.z});
  return {{"position", {camera.position.x, camera.position.y, camera.position.z}},
          {"orientation", rows},
          {"vertical_fov", camera.vertical_fov},
          {"width", camera.width},
          {"height", camera.height}};
}

Vec3 vec_of(const nlohmann::json& v) {
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

Camera camera_of(const nlohmann::json& j) {
  Camera camera;
  camera.position = vec_of(j.at("position"));
  for (std::size_t i = 0; i < 3; ++i) {
    camera.orientation.row[i] = vec_of(j.at("orientation").at(i));
  }
  camera.vertical_fov = j.at("vertical_fov").get<double>();
  camera.width = j.at("width").get<int>();
  camera.height = j.at("height").get<int>();
  return camera;
}

// What whoever joins journals relies on.
void check_head(const JournalHead& head) {
  const auto wrong = [](const std::string& what) { return Error(ErrorKind::format, what); };
  check_info(head.info);
  const HaarLayout layout(head.info.face_size);
  if (head.thresholds.size() != static_cast<std::size_t>(layout.band_count())) {
    throw wrong(fmt::format("{} thresholds, expected {}, one a band", head.thresholds.size(),
                            layout.band_count()));
  }
  if (head.meta.empty()) return;
  if (json_nests_too_deep(head.meta) ||
      !nlohmann::json::parse(head.meta, nullptr, false).is_object()) {
    throw wrong("its description is no JSON object");
  }
}

}  // namespace

std::vector<std::byte> pack_head(const JournalHead& head) {
  const TransportInfo& info = head.info;
  nlohmann::json j{{"kind", static_cast<int>(info.kind)},
                   {"face_size", info.face_size},
                   {"width", info.width},
                   {"height", info.height},
                   {"terms", info.terms},
                   {"camera", camera_json(info.camera)},
                   {"fingerprint", head.fingerprint},
                   {"thresholds", head.thresholds},
                   {"meta", head.meta},
                   {"max_bytes", head.max_bytes},
                   {"shard", {head.shard.index, head.shard.count}},
                   {"tiles", head.tiles}};
  std::vector<std::byte> rest;
  const auto add = [&](const char* name, const std::vector<std::byte>& packed) {
    rest.insert(rest.end(), packed.begin(), packed.end());
    j["parts"].push_back({{"name", name}, {"bytes", packed.size()}});
  };
  if (info.mesh) {
    add("mesh", pack_mesh(*info.mesh));
    j["mesh"] = {{"vertices", info.mesh->position.size()},
                 {"triangles", info.mesh->triangle.size()},
                 {"materials", !info.mesh->material.empty()}};
  }
  if (info.view) add("view", pack_view_factors(*info.view));
  if (info.clusters) add("clusters", pack_cluster_weights(*info.clusters));
  const std::string text = j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  FixedHead fixed{};
  std::memcpy(fixed.magic, kJournalMagic, sizeof kJournalMagic);
  fixed.text = text.size();
  fixed.rest = rest.size();
  std::vector<std::byte> bytes(sizeof fixed + text.size() + rest.size());
  std::byte* body = bytes.data() + sizeof fixed;
  std::memcpy(body, text.data(), text.size());
  if (!rest.empty()) std::memcpy(body + text.size(), rest.data(), rest.size());
  fixed.hash = XXH3_64bits(body, bytes.size() - sizeof fixed);
  std::memcpy(bytes.data(), &fixed, sizeof fixed);
  return bytes;
}

std::uint64_t packed_head_size(std::span<const std::byte> bytes) {
  FixedHead fixed;
  if (bytes.size() < sizeof fixed) return 0;
  std::memcpy(&fixed, bytes.data(), sizeof fixed);
  constexpr std::uint64_t kMost = std::uint64_t{1} << 40;
  if (std::memcmp(fixed.magic, kJournalMagic, sizeof kJournalMagic) != 0 || fixed.text > kMost ||
      fixed.rest > kMost) {
    return 0;
  }
  return sizeof fixed + fixed.text + fixed.rest;
}

JournalHead unpack_head(std::span<const std::byte> bytes, const std::string& name) {
  const auto refuse = [&](const std::string& why) -> Error {
    return {ErrorKind::format,
            fmt::format("{}: {}, expected a journal or shard of haarlight precompute", name, why)};
  };
  if (bytes.empty() || packed_head_size(bytes) != bytes.size())
    throw refuse("does not begin like one");
  FixedHead fixed;
  std::memcpy(&fixed, bytes.data(), sizeof fixed);
  const std::span<const std::byte> body = bytes.subspan(sizeof fixed);
  if (XXH3_64bits(body.data(), body.size()) != fixed.hash) throw refuse("its head is damaged");
  try {
    const char* text = reinterpret_cast<const char*>(body.data());
    if (fixed.text > body.size() || json_nests_too_deep({text, fixed.text})) {
      throw refuse("its head cannot be read");
    }
    const nlohmann::json j = nlohmann::json::parse(text, text + fixed.text);
    JournalHead head;
    TransportInfo& info = head.info;
    info.kind = static_cast<TransportKind>(j.at("kind").get<int>());
    if (info.kind < TransportKind::image || info.kind > TransportKind::clusters) {
      throw refuse("is of a kind that is not known");
    }
    info.face_size = j.at("face_size").get<int>();
    info.width = j.at("width").get<int>();
    info.height = j.at("height").get<int>();
    info.terms = j.at("terms").get<int>();
    if (info.terms < 1 || info.terms > kMaxTerms) throw refuse("its head cannot be read");
    info.camera = camera_of(j.at("camera"));
    const std::span<const std::byte> rest = body.subspan(fixed.text);
    const auto part = [&](const char* wanted) -> std::optional<std::span<const std::byte>> {
      std::size_t at = 0;
      for (const nlohmann::json& p : j.value("parts", nlohmann::json::array())) {
        const auto size = p.at("bytes").get<std::size_t>();
        if (size > rest.size() - at) throw refuse("its head cannot be read");
        if (p.at("name").get<std::string>() == wanted) return rest.subspan(at, size);
        at += size;
      }
      return std::nullopt;
    };
    if (const auto packed = part("mesh")) {
      const nlohmann::json& m = j.at("mesh");
      const MeshCounts counts{m.at("vertices").get<std::uint32_t>(),
                              m.at("triangles").get<std::uint32_t>(),
                              m.at("materials").get<bool>()};
      info.mesh = std::make_shared<const TransportMesh>(unpack_mesh(*packed, counts, name));
    }
    const std::size_t vertices = info.mesh ? info.mesh->position.size() : 0;
    if (const auto packed = part("view")) {
      info.view = std::make_shared<const ViewFactors>(
          unpack_view_factors(*packed, info.terms, vertices, name));
    }
    if (const auto packed = part("clusters")) {
      info.clusters = std::make_shared<const ClusterWeights>(
          unpack_cluster_weights(*packed, vertices, info.terms, name));
    }
    head.fingerprint = j.at("fingerprint").get<std::string>();
    head.thresholds = j.at("thresholds").get<std::vector<float>>();
    head.meta = j.at("meta").get<std::string>();
    head.max_bytes = j.at("max_bytes").get<std::uint64_t>();
    head.shard = {j.at("shard").at(0).get<int>(), j.at("shard").at(1).get<int>()};
    head.tiles = j.at("tiles").get<int>();
    check_head(head);
    return head;
  } catch (const Error& error) {
    const std::string what = error.what();
    if (what.starts_with(name)) throw;
    throw refuse("its head is of no transport (" + what + ")");
  } catch (const nlohmann::json::exception&) {
    throw refuse("its head cannot be read");
  }
}

bool same_run(const JournalHead& a, const JournalHead& b) {
  const auto run_of = [](JournalHead head) {
    head.meta.clear();
    head.shard = {};
    return pack_head(head);
  };
  return run_of(a) == run_of(b);
}

}  // namespace haarlight
