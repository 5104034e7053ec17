// BRDFs as sums of products of what comes in and what goes out.

#include "precompute/brdf_factors.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>

#include "core/parallel.h"
#include "precompute/bsdf.h"
#include "precompute/isotropic_brdf.h"

namespace haarlight {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kOrders = 25;       // m = 0..24: 64 terms of a sharp lobe reach to about 10
constexpr int kPolynomials = 32;  // in t; the terms that are kept turn more slowly

struct Quadrature {
  VectorXd node, weight;
};

// Gauss and Legendre on [0, 1].
Quadrature gauss_legendre(int count) {
  Quadrature q{VectorXd(count), VectorXd(count)};
  for (int i = 0; i < count; ++i) {
    double x = std::cos(kPi * (i + 0.75) / (count + 0.5)), slope = 1;
    for (int step = 0; step < 100; ++step) {
      double p = 1, before = 0;
      for (int n = 1; n <= count; ++n) {
        const double older = before;
        before = p;
        p = ((2 * n - 1) * x * before - (n - 1) * older) / n;
      }
      slope = count * (x * p - before) / (x * x - 1);
      const double change = p / slope;
      x -= change;
      if (std::abs(change) < 1e-15) break;
    }
    q.node[count - 1 - i] = 0.5 * (x + 1);
    q.weight[count - 1 - i] = 1 / ((1 - x * x) * slope * slope);
  }
  return q;
}

// Legendre's polynomials of 2 t - 1, a column each.
MatrixXd legendre(const VectorXd& t) {
  MatrixXd p(t.size(), kPolynomials);
  for (Index i = 0; i < t.size(); ++i) {
    const double x = 2 * t[i] - 1;
    p(i, 0) = 1;
    p(i, 1) = x;
    for (int n = 2; n < kPolynomials; ++n) {
      p(i, n) = ((2 * n - 1) * x * p(i, n - 1) - (n - 1) * p(i, n - 2)) / n;
    }
  }
  return p;
}

// Polynomials orthonormal under a weight: their values at the quadrature's nodes times the root of
// its weight, and the matrix that makes them from Legendre's.
struct Basis {
  MatrixXd at_nodes, from_legendre;
  Basis(const Quadrature& q, const VectorXd& weight) {
    const MatrixXd weighted = weight.cwiseSqrt().asDiagonal() * legendre(q.node);
    const Eigen::HouseholderQR<MatrixXd> qr(weighted);
    at_nodes = qr.householderQ() * MatrixXd::Identity(q.node.size(), kPolynomials);
    const MatrixXd r = qr.matrixQR().topRows(kPolynomials).triangularView<Eigen::Upper>();
    from_legendre =
        r.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(kPolynomials, kPolynomials));
  }
};

// The row of `table` at t, linear between ascending nodes.
Eigen::RowVector3d row_at(const VectorXd& node, const MatrixXd& table, double t) {
  Index i = 0;
  while (i + 2 < node.size() && node[i + 1] < t) ++i;
  const double share = std::clamp((t - node[i]) / (node[i + 1] - node[i]), 0.0, 1.0);
  return table.row(i) * (1 - share) + table.row(i + 1) * share;
}

int samples_for(double half_width, double whole, int least, int most) {
  const double wanted = std::ceil(whole * 4 / half_width);  // a quarter of the half width apart
  return std::clamp(static_cast<int>(std::min(wanted, 1e6)), least, most);
}

}  // namespace

struct BrdfSpectrum::State {
  bool diffuse_apart = false;
  IsotropicBrdf brdf;
  MatrixXd in_basis, out_basis;  // from Legendre's

  // A singular value of an order: one term for m = 0, else two.
  struct Group {
    int order = 0;
    double sigma = 0;
    VectorXd u, v;  // in the bases; v: [channel][polynomial]
    int terms() const { return order == 0 ? 1 : 2; }
  };
  std::vector<Group> group;  // largest first
  double total = 0;          // squared norm of all that is factored
  double apart = 0;          // of the diffuse part, if it is apart
  double apart_scale = 1;    // root mean square of its outgoing factor
  // By node: t, weight of w_i and of w_o in squared norms, albedo of what is factored together.
  VectorXd node, in_weight, out_weight;
  MatrixXd albedo;

  explicit State(const Material& material) : brdf(material) {}
  std::vector<const Group*> best(int terms) const;
  MatrixXd energy_scale(const std::vector<const Group*>& chosen) const;
};

BrdfSpectrum::BrdfSpectrum(const Material& material, bool diffuse_apart)
    : state_(std::make_unique<State>(material)) {
  State& s = *state_;
  const IsotropicBrdf& brdf = s.brdf;
  s.diffuse_apart = diffuse_apart || brdf.scalars() == 0;

  // cos theta = 1 - t^2: dw = 2 t dt dphi.
  // Microfacets' lobes are narrow near the horizon whatever they are along the normal.
  const bool microfacets = brdf.scalars() == 2;
  const int n = samples_for(brdf.half_width(), std::sqrt(2.0), microfacets ? 128 : 64, 256);
  const int turns = samples_for(brdf.half_width(), kPi, microfacets ? 256 : 64, 512);
  const Quadrature q = gauss_legendre(n);
  const VectorXd cosine = VectorXd::Ones(n) - q.node.cwiseAbs2();
  const VectorXd in_weight = 2 * q.node.cwiseProduct(q.weight);
  const VectorXd out_weight = in_weight.cwiseProduct(cosine);
  const Basis in(q, in_weight), out(q, out_weight);
  s.in_basis = in.from_legendre, s.out_basis = out.from_legendre;
  s.node = q.node, s.in_weight = in_weight, s.out_weight = out_weight;
  MatrixXd turn(kOrders, turns);  // cos m phi, with what makes a_m of a mean
  for (int m = 0; m < kOrders; ++m) {
    for (int p = 0; p < turns; ++p) {
      turn(m, p) = (m == 0 ? 1.0 : 2.0) / turns * std::cos(m * kPi * (p + 0.5) / turns);
    }
  }

  // Diffuse part, by angle.
  VectorXd diffuse_in(n), diffuse_out(n);
  for (int i = 0; i < n; ++i) {
    diffuse_in[i] = brdf.diffuse_in(cosine[i]);
    diffuse_out[i] = brdf.diffuse_out(cosine[i]);
  }
  const RgbD reflectance = s.diffuse_apart ? RgbD{1, 1, 1} : brdf.reflectance();

  // a_m and the mean square over phi of all that is factored together, light direction by light
  // direction; seen from o in three channels.
  std::vector<IsotropicBrdf::View> view;
  for (int o = 0; o < n; ++o) view.push_back(brdf.view(cosine[o]));
  std::vector<MatrixXd> order(kOrders, MatrixXd::Zero(n, 3 * n));
  std::vector<double> squares(static_cast<std::size_t>(n));
  parallel_for(n, [&](int i) {
    MatrixXd samples(turns, 3);
    double sum = 0;
    for (int o = 0; o < n; ++o) {
      const IsotropicBrdf::View& from = view[static_cast<std::size_t>(o)];
      const double flat = s.diffuse_apart ? 0 : diffuse_in[i] * diffuse_out[o];
      const RgbD diffuse = flat * reflectance;
      for (int p = 0; p < turns; ++p) {
        RgbD f = diffuse;
        if (brdf.scalars() > 0) {
          const auto value = brdf.lobe(from, cosine[i], kPi * (p + 0.5) / turns);
          for (std::size_t c = 0; c < 3; ++c) f += value[c] * from.color[c];
        }
        samples(p, 0) = f.r, samples(p, 1) = f.g, samples(p, 2) = f.b;
      }
      sum += out_weight[o] * samples.squaredNorm() / turns;
      const MatrixXd series = turn * samples;
      for (int m = 0; m < kOrders; ++m) {
        auto& a = order[static_cast<std::size_t>(m)];
        for (int c = 0; c < 3; ++c) a(i, c * n + o) = series(m, c);
      }
    }
    squares[static_cast<std::size_t>(i)] = in_weight[i] * sum;
  });
  // Norms: over the circle 2 pi each way, mean over the projected hemisphere and three channels.
  for (const double square : squares) s.total += square * 4 * kPi / 3;

  if (s.diffuse_apart && brdf.has_diffuse()) {
    const double in_square = 2 * kPi * in_weight.dot(diffuse_in.cwiseAbs2());
    const double out_square = 2 * out_weight.dot(diffuse_out.cwiseAbs2());
    // Plain Lambert goes out by 1, to the bit.
    const bool plain = (diffuse_out.array() == 1).all();
    s.apart_scale = plain ? 1 : std::sqrt(out_square);
    const RgbD& color = brdf.reflectance();
    s.apart =
        in_square * out_square *
        (brdf.scalars() == 0 ? 1 : (color.r * color.r + color.g * color.g + color.b * color.b) / 3);
    s.total += s.apart;
  }
  if (brdf.scalars() == 0) return;

  s.albedo.resize(n, 3);
  for (int c = 0; c < 3; ++c) {
    s.albedo.col(c) = 2 * kPi * order[0].middleCols(c * n, n).transpose() * in_weight;
  }
  const VectorXd in_root = in_weight.cwiseSqrt(), out_root = out_weight.cwiseSqrt();
  std::vector<std::vector<State::Group>> found(kOrders);
  parallel_for(kOrders, [&](int m) {
    const MatrixXd& a = order[static_cast<std::size_t>(m)];
    const double circle = m == 0 ? 2 * kPi : kPi;
    const double scale = circle / std::sqrt(3 * kPi);
    MatrixXd b(kPolynomials, 3 * kPolynomials);
    for (int c = 0; c < 3; ++c) {
      const MatrixXd weighted =
          in_root.asDiagonal() * a.middleCols(c * n, n) * out_root.asDiagonal();
      b.middleCols(c * kPolynomials, kPolynomials) =
          scale * (in.at_nodes.transpose() * weighted * out.at_nodes);
    }
    const Eigen::BDCSVD<MatrixXd> svd(b, Eigen::ComputeThinU | Eigen::ComputeThinV);
    for (Index k = 0; k < svd.singularValues().size(); ++k) {
      State::Group g;
      g.order = m;
      g.sigma = svd.singularValues()[k];
      g.u = svd.matrixU().col(k);
      g.v = svd.matrixV().col(k);
      found[static_cast<std::size_t>(m)].push_back(std::move(g));
    }
  });
  for (auto& groups : found) {
    for (auto& g : groups) s.group.push_back(std::move(g));
  }
  std::stable_sort(s.group.begin(), s.group.end(),
                   [](const auto& a, const auto& b) { return a.sigma > b.sigma; });
  // What is below is rounding: its vectors mean nothing (Golub and Van Loan, 5.5.8).
  const double least = 3 * kPolynomials * std::numeric_limits<double>::epsilon() / 2 *
                       (s.group.empty() ? 0 : s.group.front().sigma);
  while (!s.group.empty() && !(s.group.back().sigma > least)) s.group.pop_back();
}

bool BrdfSpectrum::has_diffuse() const { return state_->brdf.has_diffuse(); }
double BrdfSpectrum::diffuse_scale() const { return state_->apart_scale; }

BrdfSpectrum::~BrdfSpectrum() = default;
BrdfSpectrum::BrdfSpectrum(BrdfSpectrum&&) noexcept = default;

// The largest groups that fit, pairs whole.
std::vector<const BrdfSpectrum::State::Group*> BrdfSpectrum::State::best(int terms) const {
  std::vector<const Group*> chosen;
  int left = terms - (diffuse_apart && brdf.has_diffuse() ? 1 : 0);
  for (const Group& g : group) {
    if (left < 1) break;
    if (g.terms() > left) continue;
    chosen.push_back(&g);
    left -= g.terms();
  }
  return chosen;
}

// Terms ring about the lobe that they stand for, and so may give back more of an even light than it
// does: per node and channel, what of them is kept so that they do not.
MatrixXd BrdfSpectrum::State::energy_scale(const std::vector<const Group*>& chosen) const {
  const MatrixXd in = legendre(node) * in_basis, out = legendre(node) * out_basis;
  MatrixXd sum = MatrixXd::Zero(node.size(), 3);
  for (const Group* g : chosen) {
    if (g->order != 0) continue;
    const double even = 2 * kPi * in_weight.dot(in * g->u) * g->sigma / std::sqrt(2 * kPi);
    for (int c = 0; c < 3; ++c) {
      sum.col(c) += even * std::sqrt(1.5) * out * g->v.segment(c * kPolynomials, kPolynomials);
    }
  }
  MatrixXd scale = MatrixXd::Ones(node.size(), 3);
  for (Index o = 0; o < node.size(); ++o) {
    for (int c = 0; c < 3; ++c) {
      if (sum(o, c) > albedo(o, c)) scale(o, c) = std::max(0.0, albedo(o, c)) / sum(o, c);
    }
  }
  return scale;
}

int BrdfSpectrum::most_terms() const {
  int count = state_->diffuse_apart && state_->brdf.has_diffuse() ? 1 : 0;
  for (const State::Group& g : state_->group) count += g.terms();
  return count;
}

double BrdfSpectrum::error(int terms) const {
  const State& s = *state_;
  if (!(s.total > 0)) return 0;
  double kept = terms > 0 ? s.apart : 0;
  const std::vector<const State::Group*> chosen = s.best(terms);
  for (const State::Group* g : chosen) kept += g->terms() * g->sigma * g->sigma;
  if (!chosen.empty()) {  // a view's share of them, times what of it is not kept squared
    const MatrixXd out = legendre(s.node) * s.out_basis;
    const MatrixXd scale = s.energy_scale(chosen);
    for (const State::Group* g : chosen) {
      for (int c = 0; c < 3; ++c) {
        const VectorXd v = out * g->v.segment(c * kPolynomials, kPolynomials);
        const VectorXd lost = v.cwiseProduct(VectorXd::Ones(v.size()) - scale.col(c));
        kept -= g->terms() * g->sigma * g->sigma * s.out_weight.dot(lost.cwiseAbs2());
      }
    }
  }
  return std::sqrt(std::max(0.0, 1 - kept / s.total));
}

int BrdfSpectrum::terms_for(double wanted, int most) const {
  for (int k = 1; k <= most; ++k) {
    // Rounding of the sums alone keeps what is whole from being exactly 0.
    if (error(k) <= std::max(wanted, 1e-7)) return k;
  }
  return most + 1;
}

BrdfFactors BrdfSpectrum::take(int terms, int resolution) const {
  const State& s = *state_;
  BrdfFactors factors;
  factors.diffuse_apart = s.diffuse_apart;
  factors.error = error(terms);
  const VectorXd t = VectorXd::LinSpaced(resolution, 0, 1);
  if (s.diffuse_apart && s.brdf.has_diffuse() && terms > 0) {
    BrdfTerm& term = factors.term.emplace_back();
    for (Index i = 0; i < t.size(); ++i) {
      const double cosine = 1 - t[i] * t[i];
      const double out = s.brdf.diffuse_out(cosine) / s.apart_scale;
      term.incoming.push_back(s.brdf.diffuse_in(cosine) * s.apart_scale);
      term.outgoing.push_back({out, out, out});
    }
  }
  const std::vector<const State::Group*> chosen = s.best(terms);
  const MatrixXd in = legendre(t) * s.in_basis, out = legendre(t) * s.out_basis;
  MatrixXd scale(resolution, 3);
  if (!chosen.empty()) {
    const MatrixXd at_nodes = s.energy_scale(chosen);
    for (Index i = 0; i < t.size(); ++i) scale.row(i) = row_at(s.node, at_nodes, t[i]);
  }
  for (const State::Group* g : chosen) {
    const double circle = g->order == 0 ? 2 * kPi : kPi;
    VectorXd f = in * g->u * (g->sigma / std::sqrt(circle));
    MatrixXd to(resolution, 3);
    for (int c = 0; c < 3; ++c) {
      to.col(c) = out * g->v.segment(c * kPolynomials, kPolynomials) * std::sqrt(3 * kPi / circle);
    }
    to = to.cwiseProduct(scale);
    Index largest = 0;
    f.cwiseAbs().maxCoeff(&largest);
    if (f[largest] < 0) f = -f, to = -to;
    f[resolution - 1] = 0;                            // the cosine is
    if (g->order > 0) f[0] = 0, to.row(0).setZero();  // smooth at the pole
    BrdfTerm term;
    term.order = g->order;
    for (int i = 0; i < resolution; ++i) {
      term.incoming.push_back(f[i]);
      term.outgoing.push_back({to(i, 0), to(i, 1), to(i, 2)});
    }
    factors.term.push_back(term);
    if (g->order > 0) {
      term.order = -g->order;
      factors.term.push_back(term);
    }
  }
  return factors;
}

int brdf_terms(const Material& material, double error) {
  if (material.model == SurfaceModel::mirror || material.model == SurfaceModel::glass ||
      (material.model == SurfaceModel::metallic_roughness &&
       material.roughness < kMirrorRoughness && material.metallic >= 1)) {
    return 0;
  }
  return BrdfSpectrum(material, false).terms_for(error, kMostBrdfTerms);
}

double profile_at(const std::vector<double>& profile, double t) {
  const double at = std::clamp(t, 0.0, 1.0) * static_cast<double>(profile.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), profile.size() - 2);
  const double share = at - static_cast<double>(i);
  return profile[i] * (1 - share) + profile[i + 1] * share;
}

}  // namespace haarlight
