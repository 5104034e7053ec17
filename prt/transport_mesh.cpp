// Checking, packing and unpacking the mesh of a transport.

#include "prt/transport_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "prt/packing.h"

namespace haarlight {
namespace {

bool finite(const std::array<float, 3>& v) {
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

std::size_t plain_size(std::size_t vertices, std::size_t triangles, bool materials) {
  return 24 + vertices * (materials ? 28 : 24) + triangles * 12;
}

}  // namespace

std::string check_mesh(const TransportMesh& mesh) {
  const std::size_t vertices = mesh.position.size();
  if (vertices == 0) return "mesh has no vertex";
  if (vertices >= 0xffffffffu || mesh.triangle.size() >= 0xffffffffu) {
    return fmt::format("mesh has {} vertices and {} triangles, expected fewer than 2^32 - 1",
                       vertices, mesh.triangle.size());
  }
  if (mesh.normal.size() != vertices ||
      (!mesh.material.empty() && mesh.material.size() != vertices)) {
    return fmt::format("mesh has {} positions, {} normals, {} materials, expected as many of each",
                       vertices, mesh.normal.size(), mesh.material.size());
  }
  const Vec3& o = mesh.origin;
  if (!std::isfinite(o.x) || !std::isfinite(o.y) || !std::isfinite(o.z)) {
    return "origin of the mesh is not finite";
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (!finite(mesh.position[v]) || !finite(mesh.normal[v])) {
      return fmt::format("vertex {} of the mesh is not finite", v);
    }
  }
  for (std::size_t t = 0; t < mesh.triangle.size(); ++t) {
    for (const std::uint32_t v : mesh.triangle[t]) {
      if (v >= vertices) {
        return fmt::format("triangle {} has vertex {}, expected one below {}", t, v, vertices);
      }
    }
  }
  return {};
}

BoundingSphere bounding_sphere(const TransportMesh& mesh) {
  std::array<float, 3> low = mesh.position.at(0), high = low;
  for (const auto& p : mesh.position) {
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  const auto vec = [](const std::array<float, 3>& p) {
    return Vec3{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  };
  return {mesh.origin + 0.5 * (vec(low) + vec(high)), 0.5 * length(vec(high) - vec(low))};
}

std::vector<std::byte> pack_mesh(const TransportMesh& mesh) {
  std::vector<std::byte> plain(
      plain_size(mesh.position.size(), mesh.triangle.size(), !mesh.material.empty()));
  const double origin[3] = {mesh.origin.x, mesh.origin.y, mesh.origin.z};
  std::memcpy(plain.data(), origin, sizeof origin);
  put(put(put(put(plain.data() + sizeof origin, mesh.position), mesh.normal), mesh.triangle),
      mesh.material);
  return compress_bytes(plain);
}

TransportMesh unpack_mesh(std::span<const std::byte> packed, const MeshCounts& counts,
                          const std::string& name) {
  const auto damaged = [&name](const std::string& what) {
    return Error(ErrorKind::format, fmt::format("{}: {}", name, what));
  };
  const std::size_t expected = plain_size(counts.vertices, counts.triangles, counts.materials);
  const std::vector<std::byte> plain = decompress_bytes(packed, expected, expected, name, "mesh");
  TransportMesh mesh;
  double origin[3];
  std::memcpy(origin, plain.data(), sizeof origin);
  mesh.origin = {origin[0], origin[1], origin[2]};
  const std::byte* from = take(plain.data() + sizeof origin, mesh.position, counts.vertices);
  from = take(take(from, mesh.normal, counts.vertices), mesh.triangle, counts.triangles);
  take(from, mesh.material, counts.materials ? counts.vertices : 0);
  const std::string wrong = check_mesh(mesh);
  if (!wrong.empty()) throw damaged(wrong);
  return mesh;
}

}  // namespace haarlight
