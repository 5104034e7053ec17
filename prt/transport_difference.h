// How far apart the pictures of two transports are, whatever the light.

#pragma once

#include <vector>

#include "prt/transport.h"

namespace haarlight {

struct TransportDifference {
  double relative_rmse = 0;          ///< root mean square of of_lightings
  std::vector<double> of_lightings;  ///< per built-in lighting (prt/prior_lighting.h): RMS
                                     ///< difference over outputs and channels, relative to b's RMS
};

/// Compares what `a` and `b` show. Throws Error{invalid_argument} if they differ in face size, kind
/// or number of outputs.
TransportDifference transport_difference(const Transport& a, const Transport& b);

}  // namespace haarlight
