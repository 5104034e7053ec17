// Clustered PCA of a mesh's transport, from its file to the file of its clusters.

#include "cpca/compress.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "cpca/cluster_basis.h"
#include "cpca/clustering.h"
#include "cpca/sketch.h"
#include "cpca/vector_tuning.h"
#include "cpca/vector_writer.h"
#include "cpca/vertex_rows.h"
#include "prt/prior_lighting.h"
#include "prt/transport_writer.h"

namespace haarlight {
namespace {

constexpr int kVerticesPerCluster[] = {400, 200, 100, 50};  // tried where they are ours to choose
constexpr double kWorthIt = 0.95;    // of the bytes, that more clusters must save
constexpr double kGivesUp = 1.1;     // of the bytes: no more clusters are tried
constexpr std::size_t kPilots = 64;  // clusters looked at closely
constexpr int kAims = 5;             // files written at most until the error is what was asked for
constexpr double kBlockBytes = 6;    // of a stored block beside its 16 entries, about
constexpr std::size_t kMostByError = 96;  // vectors a cluster, where the error decides
constexpr int kClusteringBasis = 8;       // axes of a flat while vertices are shared out

// Shares of the whole that steps of the work take.
constexpr double kSketched = 0.25, kClustered = 0.4, kTuned = 0.5, kFound = 0.95;

void check(const CompressOptions& o, std::size_t vertices) {
  const auto refuse = [](const char* what, auto value, const std::string& wanted) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} is {}, expected {}", what, value, wanted));
  };
  if (o.clusters < 0 || static_cast<std::size_t>(o.clusters) > vertices) {
    refuse("clusters", o.clusters, fmt::format("1 to the {} vertices, or 0", vertices));
  }
  if (o.basis < 0 || o.basis > static_cast<int>(kMostVectors)) {
    refuse("basis", o.basis, fmt::format("1 to {}, or 0", kMostVectors));
  }
  if (!(o.error > 0 && o.error < 1)) refuse("error", o.error, "above 0 and below 1");
  if (o.bits != 8 && o.bits != 16) refuse("bits", o.bits, "8 or 16");
  if (o.iterations < 0 || o.iterations > 1000) refuse("iterations", o.iterations, "0 to 1000");
}

class Compressor {
 public:
  Compressor(const Transport& transport, const std::filesystem::path& file,
             const CompressOptions& options, const Progress& progress)
      : transport_(transport),
        rows_(transport),
        file_(file),
        options_(options),
        progress_(progress),
        layout_(transport.layout()),
        lightings_(prior_lightings(layout_)),
        terms_(static_cast<std::size_t>(transport.info().terms)) {
    check(options_, rows_.vertices());
  }

  CompressReport run();

 private:
  std::span<const std::uint32_t> members(std::size_t c) const {
    return std::span(weights_.vertex).subspan(weights_.first_vertex[c], weights_.vertices_of(c));
  }
  Progress part(double from, double to) const;
  void share_out(int clusters, const Progress& progress);
  void look_at_pilots(const Progress& progress);
  void choose_clusters();
  void choose_vectors(double error);
  double estimated_bytes() const;
  void set_tints();
  bool write(bool whatever_error);
  void find_vectors(TransportWriter& writer);
  void keep_weights(std::size_t c, const ClusterBasis& basis);
  void measure(std::span<const double> shown);
  std::string describe() const;

  const Transport& transport_;
  VertexRows rows_;
  const std::filesystem::path& file_;
  const CompressOptions& options_;
  const Progress& progress_;
  const HaarLayout& layout_;
  const std::vector<std::vector<float>>& lightings_;
  std::size_t terms_;
  Sketch sketch_;
  std::vector<std::vector<double>> sigma_;  // [cluster], estimated singular values
  VectorTuning tuning_{lightings_};
  std::size_t most_ = options_.basis > 0 ? static_cast<std::size_t>(options_.basis) : kMostByError;
  double cut_ = 0;
  ClusterWeights weights_;
  std::vector<std::size_t> weight_begin_;
  float threshold_ = 0;
  std::vector<std::vector<float>> exact_;     // [cluster], as in ClusterBasis
  std::vector<std::uint8_t> cluster_is_rgb_;  // its rows have three channels
  CompressReport report_;
};

Progress Compressor::part(double from, double to) const {
  return [this, from, to](double share) {
    return !progress_ || progress_(from + (to - from) * share);
  };
}

// Vertices to clusters.
void Compressor::share_out(int clusters, const Progress& progress) {
  const std::size_t vertices = rows_.vertices();
  ClusteringOptions clustering;
  clustering.clusters = clusters;
  clustering.basis =
      options_.basis > 0 ? std::min(kClusteringBasis, options_.basis) : kClusteringBasis;
  clustering.iterations = options_.iterations;
  clustering.seed = options_.seed;
  const Clustering found = cluster_points(sketch_, clustering, progress);
  report_.clusters = found.clusters;
  report_.inertia = found.inertia;

  const auto count = static_cast<std::size_t>(found.clusters);
  weights_ = {};
  weights_.bits = options_.bits;
  weights_.first_vertex.assign(count + 1, 0);
  for (const std::uint32_t c : found.cluster) ++weights_.first_vertex[c + 1];
  for (std::size_t c = 0; c < count; ++c) {
    weights_.first_vertex[c + 1] += weights_.first_vertex[c];
  }
  std::vector<std::uint32_t> next(weights_.first_vertex.begin(), weights_.first_vertex.end() - 1);
  weights_.vertex.resize(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    weights_.vertex[next[found.cluster[v]]++] = static_cast<std::uint32_t>(v);
  }
}

// A few clusters are taken apart as widely as any choice wants them.
void Compressor::look_at_pilots(const Progress& progress) {
  const auto clusters = static_cast<std::size_t>(report_.clusters);
  sigma_.assign(clusters, {});
  parallel_for(static_cast<int>(clusters), [&](int i) {
    const auto c = static_cast<std::size_t>(i);
    sigma_[c] = estimated_sizes(sketch_, members(c));
    for (double& s : sigma_[c]) s *= std::sqrt(static_cast<double>(weights_.vertices_of(c)));
  });
  const std::size_t step = std::max<std::size_t>(1, clusters / kPilots);
  std::vector<std::size_t> pilots;
  for (std::size_t c = step / 2; c < clusters; c += step) pilots.push_back(c);
  // Bases are large: a thread has one at a time.
  std::vector<VectorTuning::Cluster> measured(pilots.size());
  parallel_for(static_cast<int>(pilots.size()), [&](int i) {
    const std::size_t c = pilots[static_cast<std::size_t>(i)];
    const ClusterBasis basis = find_basis(rows_, sketch_, members(c), most_, lightings_);
    measured[static_cast<std::size_t>(i)] = tuning_.measured(basis, members(c).size(), sigma_[c]);
  });
  tuning_.clear();
  for (VectorTuning::Cluster& cluster : measured) tuning_.add(std::move(cluster));
  if (progress && !progress(1)) throw Error(ErrorKind::cancelled, "compression stopped on request");
}

// The fewest clusters whose file is about as small as any that were tried.
void Compressor::choose_clusters() {
  if (options_.clusters > 0) {
    share_out(options_.clusters, part(kSketched, kClustered));
    look_at_pilots(part(kClustered, kTuned));
    return;
  }
  struct Try {
    ClusterWeights weights;
    std::vector<std::vector<double>> sigma;
    VectorTuning tuning;
    int clusters = 0;
    std::vector<double> inertia;
    double bytes = 0, left = 0;
  };
  std::optional<Try> best;
  const auto vertices = static_cast<int>(rows_.vertices());
  constexpr double kEach = (kTuned - kSketched) / std::size(kVerticesPerCluster);
  double from = kSketched;
  for (const int size : kVerticesPerCluster) {
    const int clusters = std::max(1, vertices / size);
    from += kEach;
    if (best && clusters <= best->clusters) continue;  // few vertices
    share_out(clusters, part(from - kEach, from - 0.3 * kEach));
    look_at_pilots(part(from - 0.3 * kEach, from));
    choose_vectors(options_.error);
    Try now{weights_, sigma_, tuning_, report_.clusters, report_.inertia, estimated_bytes(), 0};
    now.left = std::max(report_.basis_error - options_.error, 0.0);
    // Where the error is out of reach, what comes nearest. More clusters take longer to find and
    // to relight: they must be worth it.
    const bool better = !best || now.left < best->left ||
                        (now.left == best->left && now.bytes < kWorthIt * best->bytes);
    const bool worse = best && now.left == best->left && now.bytes > kGivesUp * best->bytes;
    if (better) best = std::move(now);
    if (worse) break;
  }
  weights_ = std::move(best->weights);
  sigma_ = std::move(best->sigma);
  tuning_ = std::move(best->tuning);
  report_.clusters = best->clusters;
  report_.inertia = std::move(best->inertia);
}

// Of the file, with the vectors and the threshold chosen.
double Compressor::estimated_bytes() const {
  const VectorTuning::Kept kept = tuning_.kept(cut_, most_, threshold_);
  const double all = kept.vectors > 0 ? weights_.vectors() / kept.vectors : 0;
  return all * kept.entries * (1 + kBlockBytes / static_cast<double>(kBlockRows)) +
         static_cast<double>(weight_begin_.back()) * options_.bits / 8;
}

// How many vectors each cluster has, and what is small enough to be dropped of them, so that the
// picture is about `error` off.
void Compressor::choose_vectors(double error) {
  const auto clusters = static_cast<std::size_t>(report_.clusters);
  // Half of the squared error to vectors left out, where they are ours to choose; the rest to
  // entries dropped, to rounding, and to clusters that are not like the few that were looked at.
  cut_ = 0;
  double left = 0.5 * error;
  if (options_.basis == 0) {
    cut_ = tuning_.cut_for(0.75 * error, most_);
    left = 0.4 * error;
  }
  threshold_ = tuning_.threshold_for(left, cut_, most_);
  report_.basis_error = tuning_.basis_error(cut_, most_);

  weights_.first_vector.assign(1, 0);
  for (std::size_t c = 0; c < clusters; ++c) {
    const std::size_t count = std::min(vectors_above(sigma_[c], cut_, most_), members(c).size());
    weights_.first_vector.push_back(weights_.first_vector.back() +
                                    static_cast<std::uint32_t>(count));
  }
  // A file has at least one row.
  if (weights_.vectors() == 0) weights_.first_vector.back() = 1;
  weights_.scale.assign(weights_.vectors(), 0.0f);
  weight_begin_ = weights_.weight_begin();
  weights_.weight.assign(weight_begin_.back(), 0);
  report_.vectors = weights_.vectors();
}

void Compressor::keep_weights(std::size_t c, const ClusterBasis& basis) {
  const std::size_t n = members(c).size();
  const double most = options_.bits == 8 ? 127 : 32767;
  const std::size_t count = std::min<std::size_t>(basis.count, weights_.vectors_of(c));
  for (std::size_t i = 0; i < count; ++i) {
    const double* w = basis.weight.data() + i * n;
    double largest = 0;
    for (std::size_t v = 0; v < n; ++v) largest = std::max(largest, std::abs(w[v]));
    const auto scale = static_cast<float>(largest / most);
    weights_.scale[weights_.first_vector[c] + i] = scale;
    if (!(scale > 0)) continue;
    for (std::size_t v = 0; v < n; ++v) {
      const double q = std::nearbyint(w[v] / static_cast<double>(scale));
      weights_.weight[weight_begin_[c] + i * n + v] =
          static_cast<std::int16_t>(std::clamp(q, -most, most));
    }
  }
}

void Compressor::find_vectors(TransportWriter& writer) {
  const auto clusters = static_cast<std::size_t>(report_.clusters);
  exact_.resize(clusters);
  cluster_is_rgb_.assign(clusters, 0);
  VectorWriter out(writer, layout_, static_cast<int>(terms_), threshold_, lightings_);
  const auto group = static_cast<std::size_t>(2 * thread_count());
  std::vector<ClusterBasis> bases(group);
  const Progress progress = part(kTuned, kFound);
  for (std::size_t first = 0; first < clusters; first += group) {
    const std::size_t count = std::min(group, clusters - first);
    parallel_for(static_cast<int>(count), [&](int i) {
      const std::size_t c = first + static_cast<std::size_t>(i);
      bases[c - first] = find_basis(rows_, sketch_, members(c), weights_.vectors_of(c), lightings_);
    });
    for (std::size_t c = first; c < first + count; ++c) {
      ClusterBasis& basis = bases[c - first];
      out.add(basis, weights_.vectors_of(c));
      keep_weights(c, basis);
      cluster_is_rgb_[c] = basis.channels == 3;
      exact_[c] = std::move(basis.exact);
    }
    out.flush(false);
    if (!progress(static_cast<double>(first + count) / static_cast<double>(clusters))) {
      throw Error(ErrorKind::cancelled, fmt::format("{}: stopped on request", file_.string()));
    }
  }
  out.flush(true);
  measure(out.shown());
}

// Vertices' sums as the file has them against the transport's, under the built-in lightings.
void Compressor::measure(std::span<const double> shown) {
  report_.of_lightings.clear();
  report_.measured_error = 0;
  const auto clusters = static_cast<std::size_t>(report_.clusters);
  const std::size_t lights = lightings_.size();
  std::vector<std::vector<double>> error(clusters), energy(clusters);
  parallel_for(static_cast<int>(clusters), [&](int i) {
    const auto c = static_cast<std::size_t>(i);
    error[c].assign(lights, 0.0);
    energy[c].assign(lights, 0.0);
    const std::size_t n = members(c).size(), vectors = weights_.vectors_of(c);
    const std::size_t channels = cluster_is_rgb_[c] ? 3 : 1;
    const std::size_t first_row = weights_.first_vector[c] * terms_;
    for (std::size_t l = 0; l < lights; ++l) {
      for (std::size_t v = 0; v < n; ++v) {
        for (std::size_t p = 0; p < terms_ * channels; ++p) {
          const std::size_t k = p / channels, ch = p % channels;
          double sum = 0;
          for (std::size_t s = 0; s < vectors; ++s) {
            const double w = static_cast<double>(weights_.scale[weights_.first_vector[c] + s]) *
                             weights_.weight[weight_begin_[c] + s * n + v];
            sum += w * shown[((first_row + k * vectors + s) * lights + l) * 3 + ch];
          }
          const double right = static_cast<double>(exact_[c][(l * n + v) * terms_ * channels + p]);
          // A grey sum stands for three channels whose squared colours add up to 3.
          const double share = channels == 1 ? 3 : 1;
          error[c][l] += share * (sum - right) * (sum - right);
          energy[c][l] += share * right * right;
        }
      }
    }
  });
  for (std::size_t l = 0; l < lights; ++l) {
    double off = 0, all = 0;
    for (std::size_t c = 0; c < clusters; ++c) {
      off += error[c][l];
      all += energy[c][l];
    }
    report_.of_lightings.push_back(all > 0 ? std::sqrt(off / all) : 0.0);
    report_.measured_error = std::max(report_.measured_error, report_.of_lightings.back());
  }
}

std::string Compressor::describe() const {
  const std::string& text = options_.meta.empty() ? transport_.info().meta : options_.meta;
  nlohmann::json meta = nlohmann::json::parse(text, nullptr, false);
  if (!meta.is_object()) meta = nlohmann::json::object();
  nlohmann::json source;
  for (const char* key : {"measured_error", "thresholds", "bytes"}) {
    if (meta.contains(key)) source[key] = meta[key];
  }
  source["file_bytes"] = transport_.file_bytes();
  meta["compressed"] = {{"clusters", report_.clusters}, {"vectors", report_.vectors},
                        {"basis", options_.basis},      {"error", options_.error},
                        {"weight_bits", options_.bits}, {"seed", options_.seed},
                        {"threshold", threshold_},      {"of_lightings", report_.of_lightings},
                        {"source", std::move(source)}};
  return meta.dump(2);
}

// What factors each vertex' sums have beside those of its cluster.
void Compressor::set_tints() {
  weights_.tint.clear();
  if (rows_.vertices() > 0) {
    bool tinted = false;
    for (const std::uint32_t v : weights_.vertex) {
      for (std::size_t k = 0; k < terms_; ++k) {
        // Clusters with a coloured row hold all their rows' colours in their vectors; set below.
        weights_.tint.push_back(ClusterWeights::tint_bits(rows_.tint(v, static_cast<int>(k))));
        tinted |= !(weights_.tint.back() == ClusterWeights::tint_bits({1, 1, 1}));
      }
    }
    if (!tinted) weights_.tint.clear();
  }
  if (!weights_.tint.empty()) {
    for (std::size_t c = 0; c + 1 < weights_.first_vertex.size(); ++c) {
      const auto of_cluster = members(c);
      if (std::none_of(of_cluster.begin(), of_cluster.end(),
                       [&](std::uint32_t v) { return rows_.is_rgb(v); })) {
        continue;
      }
      std::fill(
          weights_.tint.begin() + static_cast<std::ptrdiff_t>(weights_.first_vertex[c] * terms_),
          weights_.tint.begin() +
              static_cast<std::ptrdiff_t>(weights_.first_vertex[c + 1] * terms_),
          ClusterWeights::tint_bits({1, 1, 1}));
    }
  }
}

// Whether the file was written: it is not if its error is too large, unless told so.
bool Compressor::write(bool whatever_error) {
  TransportInfo info = transport_.info();
  info.kind = TransportKind::clusters;
  info.meta.clear();
  info.clusters = std::make_shared<const ClusterWeights>(weights_);
  TransportWriterOptions writing;
  // What is small has been dropped before rows were brought to one size.
  writing.thresholds.assign(static_cast<std::size_t>(layout_.band_count()), 0.0f);
  writing.fingerprint = "clusters";
  TransportWriter writer(file_, info, writing);
  try {
    find_vectors(writer);
    if (!whatever_error && report_.measured_error > options_.error) {
      writer.discard();
      return false;
    }
    FinishOptions finish;
    finish.clusters = std::make_shared<const ClusterWeights>(weights_);
    finish.measured_error = report_.measured_error;
    finish.column_norms.assign(transport_.column_norms().begin(), transport_.column_norms().end());
    finish.progress = part(kFound, 1);
    report_.bytes = writer.finish(describe(), finish).bytes;
  } catch (...) {
    writer.discard();
    throw;
  }
  return true;
}

CompressReport Compressor::run() {
  const int basis = options_.basis > 0 ? options_.basis : 32;
  const int dims = std::clamp((4 * basis + 63) / 64 * 64, 128, 512);
  sketch_ = sketch_rows(rows_, dims, options_.seed, part(0, kSketched));
  choose_clusters();
  const bool reachable = options_.basis == 0 && tuning_.basis_error(0, most_) <= options_.error;
  double aim = options_.error;
  for (int left = kAims; left > 0; --left) {
    choose_vectors(left == 1 && reachable ? 0 : aim);
    set_tints();
    // What vectors cannot reach is left. The last try leaves out nothing.
    if (write(!reachable || left == 1)) break;
    aim *= std::min(0.95, 0.97 * options_.error / report_.measured_error);
  }
  return std::move(report_);
}

}  // namespace

CompressReport compress_transport(const Transport& transport, const std::filesystem::path& file,
                                  const CompressOptions& options, const Progress& progress) {
  return Compressor(transport, file, options, progress).run();
}

}  // namespace haarlight
