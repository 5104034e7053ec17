// Clustered PCA of a mesh's transport: a file of vertices' rows becomes one of clusters' vectors
// (Sloan and others 2003; Liu and others 2004; Overbeck 2006, section 6.3).

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "prt/transport.h"

namespace haarlight {

struct CompressOptions {
  int clusters = 0;        ///< 1 to vertices; 0: of one per 400, 200, 100 or 50 vertices the fewest
                           ///< whose file is within 5 % of the smallest, by an estimate from a few
                           ///< clusters of each; where none reaches `error`, what comes nearest
  int basis = 0;           ///< vectors a cluster, 1 to 256; 0: by `error`, each cluster its own
  double error = 0.01;     ///< relative picture error, > 0 and < 1. Without a basis the file's
                           ///< measured_error is no larger: it is written anew until it is, five
                           ///< times at most, unless no more vectors can help; with one, half of it
                           ///< goes into dropping entries of vectors
  int bits = 16;           ///< of a weight, 8 or 16
  int iterations = 12;     ///< of assignment and PCA, 0 to 1000
  std::uint64_t seed = 1;  ///< of the first clusters
  std::string meta{};      ///< JSON object to keep in place of the transport's description
};

struct CompressReport {
  int clusters = 0;
  std::uint32_t vectors = 0;         ///< of all clusters
  std::uint64_t bytes = 0;           ///< of the file
  double measured_error = 0;         ///< largest relative RMS error of vertices' sums over the
                                     ///< built-in lightings, against the transport's
  std::vector<double> of_lightings;  ///< of each of them
  double basis_error = 0;            ///< the part that more vectors would mend, estimated from a
                                     ///< few clusters
  std::vector<double> inertia;       ///< see Clustering
};

/// Writes `file`, a transport of kind clusters, in bounded memory: the transport is streamed, once
/// for a sketch and once for each time vectors are found (see CompressOptions::error). The same
/// bytes on any number of threads. Throws Error{invalid_argument} for the transport of a picture or
/// of clusters and for options out of range, Error{io}, Error{cancelled}; then no file is left.
CompressReport compress_transport(const Transport& transport, const std::filesystem::path& file,
                                  const CompressOptions& options, const Progress& progress = {});

}  // namespace haarlight
