// A run shared by the processes that mpirun started.

#pragma once

#include <memory>

#include "precompute/distribution.h"

namespace haarlight {

/// The processes of this run, if mpirun (or another starter of MPI processes) started more than
/// one; null otherwise. Throws Error{invalid_argument} if it did and the program was built without
/// MPI: each process would write the same file.
std::unique_ptr<Distribution> start_distribution();

}  // namespace haarlight
