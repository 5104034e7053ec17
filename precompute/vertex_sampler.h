// The vertices of a mesh as places where light is gathered.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "precompute/point_tracer.h"
#include "precompute/receiver.h"
#include "precompute/scene.h"
#include "precompute/vertex_terms.h"
#include "precompute/visibility.h"

namespace haarlight {

/// A vertex lies on the border of its triangles and of all others that meet there, so that the
/// place to look from needs care. Its side is that of its shading normal. The place is moved
///   into its own triangles (those that have this very vertex, or one of the same place and normal
///   across an edge of two triangles) by a thousandth, where they end at it: what touches it
///   without being joined to it does not decide by a rounding;
///   off the planes of its own triangles, and of those that share its place and rise above them
///   (the wall at the foot of which a floor ends), by Visibility::kSurfaceOffset at least.
/// A convex body casts no shadow on itself then, in a closed room no vertex sees out, and vertices
/// that only texture coordinates keep apart see the same.
///
/// Without terms only what is seen alike from everywhere is kept of a material: its diffuse part,
/// under a coat with the coat's mean share of light let out. With terms every vertex has a receiver
/// for each term of its BRDF. Textures are looked up at the vertex; normal textures, finer than
/// vertices, are left out.
class VertexSampler {
 public:
  /// `scene` may be a finer version of the scene that `visibility` was made from, with the same
  /// surfaces. Keeps references.
  VertexSampler(const Scene& scene, const Visibility& visibility);

  /// Terms of the vertices' BRDFs, or null; not owned. Rows are then (vertex, term).
  void set_terms(const VertexTerms* terms) { terms_ = terms; }
  int terms() const { return terms_ ? terms_->terms : 1; }

  /// What each vertex is made of.
  std::vector<VertexMaterial> materials() const;

  /// The receiver of a vertex, of weight 1, its diffuse part alone. Vertices that no triangle uses
  /// are black.
  Receiver receiver(std::uint32_t vertex, std::uint32_t row) const;

  /// Where the vertex gathers light, without its material.
  ShadingPoint point(std::uint32_t vertex) const;

  /// Receivers of the rows `outputs` (kTileRows entries, vertex * terms + term, kNoOutput: none),
  /// replacing what `tile` holds.
  void sample(std::span<const std::uint32_t> outputs, TileReceivers& tile) const;

  /// Vertices whose material has more than a diffuse part: lobes, mirrors, glass.
  std::int64_t view_dependent() const { return view_dependent_; }

 private:
  struct Corner {
    std::uint32_t vertex = 0, triangle = 0, corner = 0;
  };
  void join_sheets();
  VertexMaterial material_at(std::uint32_t vertex) const;
  Receiver receiver_at(std::uint32_t vertex, std::uint32_t row, const Vec3& from) const;
  bool make_term(std::uint32_t vertex, int term, Receiver& receiver) const;
  Vec3 centre(std::uint32_t triangle) const;
  Vec3 face_normal(std::uint32_t triangle) const;
  Vec3 origin(std::uint32_t vertex) const;

  const Scene& scene_;
  const Visibility& visibility_;
  std::vector<Vec3> position_;            // local, of each vertex
  std::vector<std::uint32_t> place_;      // of each vertex: vertices at one place share it
  std::vector<std::uint32_t> sheet_;      // of each vertex: those of one sheet at a place share it
  std::vector<std::uint32_t> first_;      // of each place in triangles_, and the end
  std::vector<std::uint32_t> triangles_;  // around each place, ascending
  std::vector<std::uint32_t> material_;   // of each vertex: that of its first triangle
  std::int64_t view_dependent_ = 0;
  const VertexTerms* terms_ = nullptr;
};

}  // namespace haarlight
