// The BRDFs of a mesh's vertices as terms.

#include "precompute/vertex_terms.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "precompute/brdf_factors.h"
#include "precompute/fresnel.h"

namespace haarlight {
namespace {

constexpr int kResolution = 256;  // samples of a profile
constexpr double kAll = 1e-3;     // error at which a BRDF is as good as whole
constexpr double kLevels = 8;     // of metalness and roughness that a texture varies

// Sums over the vertices of a set.
struct Mean {
  RgbD albedo;
  double metallic = 0, roughness = 0;
  double count = 0;
  bool varies = false;  // the albedo, or the metalness: diffuse part and lobe then differ
  Rgb first;
  float first_metallic = 0;

  void add(const VertexMaterial& v) {
    if (count == 0) first = v.albedo, first_metallic = v.metallic;
    varies = varies || !(v.albedo == first) || v.metallic != first_metallic;
    albedo += RgbD(v.albedo);
    metallic += static_cast<double>(v.metallic), roughness += static_cast<double>(v.roughness);
    count += 1;
  }
};

// The colour of a lobe seen along the normal, but for a factor that all vertices of a set share.
RgbD lobe_color(const Material& material, const RgbD& albedo, double metallic) {
  if (material.model == SurfaceModel::mirror) return albedo;
  if (material.model != SurfaceModel::metallic_roughness) return {1, 1, 1};
  const double root =
      (static_cast<double>(material.ior) - 1) / (static_cast<double>(material.ior) + 1);
  const double coat = std::max(root * root, 1e-6);
  return RgbD{coat, coat, coat} * (1 - metallic) + albedo * metallic;
}

bool is_diffuse(const Material& m) {
  return m.model == SurfaceModel::phong && l1_norm(m.specular) == 0;
}

// Between two profiles of `factors`.
IncomingTerm incoming_term(const BrdfTerm& term) {
  IncomingTerm in;
  in.order = term.order;
  const auto samples = term.incoming.size();
  for (std::size_t i = 0; i < samples; ++i) {
    in.profile.push_back(static_cast<float>(term.incoming[i]));
    const double t = static_cast<double>(i) / static_cast<double>(samples - 1);
    in.importance += std::abs(term.incoming[i]) * 4 * kPi * t / static_cast<double>(samples - 1);
  }
  return in;
}

}  // namespace

void check(const TermOptions& options) {
  if (options.terms < 0 || options.terms > kMostBrdfTerms) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("terms is {}, expected 1 to {}, or 0 for as many as are needed",
                            options.terms, kMostBrdfTerms));
  }
  if (!(options.error >= 0) || !(options.error < 1)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("error of terms is {}, expected 0 to below 1", options.error));
  }
  if (options.most < 1 || options.most > kMostBrdfTerms) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("most terms is {}, expected 1 to {}", options.most, kMostBrdfTerms));
  }
}

VertexTerms vertex_terms(const Scene& scene, std::span<const VertexMaterial> vertices,
                         const TermOptions& options) {
  check(options);
  // Which vertices share a set.
  using Key = std::tuple<std::uint32_t, int, int>;
  std::map<Key, Mean> means;
  const auto key_of = [&](const VertexMaterial& v) -> Key {
    const Material& m = scene.material[v.material];
    if (m.metallic_roughness_texture < 0) return {v.material, 0, 0};
    const auto level = [](float x) {
      return static_cast<int>(std::lround(kLevels * static_cast<double>(x)));
    };
    return {v.material, level(v.metallic), level(v.roughness)};
  };
  for (const VertexMaterial& v : vertices) means[key_of(v)].add(v);

  VertexTerms out;
  std::map<Key, std::uint32_t> number;
  std::vector<BrdfFactors> factors;
  for (const auto& [key, mean] : means) {
    Material m = scene.material[std::get<0>(key)];
    number[key] = static_cast<std::uint32_t>(out.set.size());
    m.albedo = Rgb(mean.albedo * (1 / mean.count));
    m.metallic = static_cast<float>(mean.metallic / mean.count);
    m.roughness = static_cast<float>(mean.roughness / mean.count);
    const bool apart = options.apart || mean.varies || is_diffuse(m);
    const BrdfSpectrum spectrum(m, apart);
    int terms = options.terms;
    if (terms == 0) {
      terms = std::min(spectrum.terms_for(options.error, options.most), options.most);
    } else {
      terms = std::min(terms, spectrum.terms_for(kAll, terms));
    }
    factors.push_back(spectrum.take(terms, kResolution));
    const BrdfFactors& f = factors.back();
    TermSet& set = out.set.emplace_back();
    set.material = std::get<0>(key);
    set.error = f.error;
    set.lobe_color = lobe_color(m, RgbD(m.albedo), static_cast<double>(m.metallic));
    std::size_t first = 0;
    if (f.diffuse_apart && spectrum.has_diffuse()) {
      set.diffuse_apart = true;
      set.diffuse_scale = spectrum.diffuse_scale();
      first = 1;
    }
    for (std::size_t k = first; k < f.term.size(); ++k) {
      set.incoming.push_back(incoming_term(f.term[k]));
    }
    out.terms = std::max(out.terms, set.terms());
    if (f.error > out.worst_error) out.worst_error = f.error, out.worst_material = m.name;
  }

  ViewFactors view;
  view.terms = out.terms;
  view.resolution = kResolution;
  bool alike = true;
  for (const BrdfFactors& f : factors) {
    for (int k = 0; k < out.terms; ++k) {
      const bool there = k < static_cast<int>(f.term.size());
      const BrdfTerm* term = there ? &f.term[static_cast<std::size_t>(k)] : nullptr;
      view.order.push_back(there ? term->order : 0);
      for (std::size_t i = 0; i < kResolution; ++i) {
        view.profile.push_back(there ? Rgb(term->outgoing[i]) : Rgb{});
        if (there && !(view.profile.back() == Rgb{1, 1, 1})) alike = false;
      }
    }
  }
  for (const VertexMaterial& v : vertices) {
    const std::uint32_t s = number.at(key_of(v));
    out.set_of.push_back(s);
    const Material& m = scene.material[v.material];
    const RgbD own = lobe_color(m, RgbD(v.albedo), static_cast<double>(v.metallic));
    const RgbD& base = out.set[s].lobe_color;
    const auto ratio = [](double a, double b) { return b > 0 ? static_cast<float>(a / b) : 1.0f; };
    // Of a measured material the albedo only tints.
    out.lobe_tint.push_back(
        m.model == SurfaceModel::measured
            ? v.albedo
            : Rgb{ratio(own.r, base.r), ratio(own.g, base.g), ratio(own.b, base.b)});
  }
  view.set_of = out.set_of;
  if (!alike) out.view = std::make_shared<const ViewFactors>(std::move(view));
  return out;
}

}  // namespace haarlight
