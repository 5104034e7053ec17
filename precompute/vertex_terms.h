// The BRDFs of a mesh's vertices as terms: incoming factors to trace, outgoing ones to show.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/rgb.h"
#include "precompute/incoming_term.h"
#include "precompute/scene.h"
#include "prt/view_factors.h"

namespace haarlight {

/// How many terms a BRDF gets.
struct TermOptions {
  int terms = 0;       ///< of each BRDF at most; 0: as many as `error` asks for, up to `most`
  double error = 0.1;  ///< of a BRDF, as in BrdfFactors; [0, 1)
  int most = 16;       ///< terms where `error` decides, [1, kMostBrdfTerms]
  bool apart = false;  ///< the diffuse part is always a term by itself, as plans want it

  friend bool operator==(const TermOptions&, const TermOptions&) = default;
};

/// Throws Error{invalid_argument} naming the option, its value and what was wanted.
void check(const TermOptions& options);

/// What a vertex is made of: material and texture factors there.
struct VertexMaterial {
  std::uint32_t material = 0;
  Rgb albedo;
  float metallic = 0, roughness = 1;
};

/// What the rows of a vertex' terms are of; shared by all vertices of a set.
struct TermSet {
  std::uint32_t material = 0;
  bool diffuse_apart = false;          ///< term 0 is the diffuse part, traced as such
  double diffuse_scale = 1;            ///< of its row
  std::vector<IncomingTerm> incoming;  ///< the others, in order
  RgbD lobe_color{1, 1, 1};            ///< of the BRDF that was factored; a vertex' own colour by
                                       ///< it is the colour of its rows
  double error = 0;                    ///< see BrdfFactors
  int terms() const { return static_cast<int>(incoming.size()) + (diffuse_apart ? 1 : 0); }
};

/// Vertices of one material share a set where its numbers are the same; texture factors of
/// metalness and roughness are rounded to eighths for it, and the set is made of their mean. The
/// diffuse colour is exact at each vertex; a metal's varying colour multiplies its lobe, the
/// Fresnel edge, which is white, with it.
struct VertexTerms {
  int terms = 1;
  std::vector<TermSet> set;
  std::vector<std::uint32_t> set_of;        ///< one a vertex
  std::vector<Rgb> lobe_tint;               ///< one a vertex: colour of the rows of `incoming`
  std::shared_ptr<const ViewFactors> view;  ///< null if all looks alike from everywhere
  double worst_error = 0;                   ///< of the sets
  std::string worst_material;               ///< name of that one's
};

/// Factors the BRDFs of all vertices. Throws as check() does.
VertexTerms vertex_terms(const Scene& scene, std::span<const VertexMaterial> vertices,
                         const TermOptions& options);

}  // namespace haarlight
