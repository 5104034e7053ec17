// The order in which a mesh's vertices are stored as rows.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "prt/transport_writer.h"

namespace haarlight {
namespace {

using Place = std::array<float, 6>;  // position over the mesh's size, normal times kNormalWeight

// How far normals that are opposite lie apart, against the mesh's size. Light from one side changes
// with the normal over all of its range, and with the position over the size of what shadows.
constexpr float kNormalWeight = 0.1f;

std::vector<Place> places_of(const TransportMesh& mesh) {
  const BoundingSphere sphere = bounding_sphere(mesh);
  const auto scale = static_cast<float>(sphere.radius > 0 ? 0.5 / sphere.radius : 1.0);
  std::vector<Place> places(mesh.position.size());
  for (std::size_t v = 0; v < places.size(); ++v) {
    for (std::size_t i = 0; i < 3; ++i) {
      places[v][i] = scale * mesh.position[v][i];
      places[v][3 + i] = 0.5f * kNormalWeight * mesh.normal[v][i];
    }
  }
  return places;
}

// Sorts vertices so that aligned runs of a chunk, a tile and a block each lie close together.
void cut(const std::vector<Place>& places, std::span<std::uint32_t> vertices) {
  constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);
  constexpr auto kTile = static_cast<std::size_t>(kTileRows);
  constexpr auto kChunk = static_cast<std::size_t>(kChunkRows);
  if (vertices.size() <= kBlock) {
    std::sort(vertices.begin(), vertices.end());
    return;
  }
  Place low = places[vertices[0]], high = low;
  for (const std::uint32_t v : vertices) {
    for (std::size_t i = 0; i < low.size(); ++i) {
      low[i] = std::min(low[i], places[v][i]);
      high[i] = std::max(high[i], places[v][i]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t i = 1; i < low.size(); ++i) {
    if (high[i] - low[i] > high[axis] - low[axis]) axis = i;
  }
  // The nearest whole number of the largest unit that fits; the first part is always full.
  const std::size_t unit = vertices.size() > kChunk  ? kChunk
                           : vertices.size() > kTile ? kTile
                                                     : kBlock;
  const std::size_t first = std::max(unit, vertices.size() / 2 / unit * unit);
  std::nth_element(vertices.begin(), vertices.begin() + static_cast<std::ptrdiff_t>(first),
                   vertices.end(), [&](std::uint32_t a, std::uint32_t b) {
                     const float x = places[a][axis], y = places[b][axis];
                     return x != y ? x < y : a < b;
                   });
  cut(places, vertices.first(first));
  cut(places, vertices.subspan(first));
}

}  // namespace

std::vector<std::uint32_t> mesh_row_order(const TransportMesh& mesh, int terms) {
  const std::size_t vertices = mesh.position.size();
  std::vector<std::uint32_t> sorted(vertices);
  for (std::size_t v = 0; v < vertices; ++v) sorted[v] = static_cast<std::uint32_t>(v);
  if (vertices > 0) cut(places_of(mesh), sorted);

  constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);
  constexpr auto kChunk = static_cast<std::size_t>(kChunkRows);
  const auto count = static_cast<std::size_t>(terms);
  const std::size_t blocks = (vertices + kBlock - 1) / kBlock * count;
  const std::size_t chunks = (blocks * kBlock + kChunk - 1) / kChunk;
  std::vector<std::uint32_t> order(chunks * kChunk, kNoOutput);
  for (std::size_t i = 0; i < vertices; ++i) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t block = i / kBlock * count + k;
      order[block * kBlock + i % kBlock] = static_cast<std::uint32_t>(sorted[i] * count + k);
    }
  }
  return order;
}

std::vector<std::uint32_t> plain_row_order(std::size_t outputs) {
  constexpr auto kChunk = static_cast<std::size_t>(kChunkRows);
  std::vector<std::uint32_t> order((outputs + kChunk - 1) / kChunk * kChunk, kNoOutput);
  std::iota(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(outputs), 0u);
  return order;
}

std::vector<std::uint32_t> row_order(const TransportInfo& info) {
  if (info.clusters) return plain_row_order(info.output_count());
  return info.mesh ? mesh_row_order(*info.mesh, info.terms)
                   : image_row_order(info.width, info.height);
}

int used_tiles(std::span<const std::uint32_t> order) {
  std::size_t rows = order.size();
  while (rows > 0 && order[rows - 1] == kNoOutput) --rows;
  return static_cast<int>((rows + kTileRows - 1) / kTileRows);
}

}  // namespace haarlight
