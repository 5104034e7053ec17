// How much memory there is, and how many workers fit.

#pragma once

#include <cstdint>

namespace haarlight {

/// Bytes that programs could still take: of the machine, or of the control group if it allows less.
/// 0 if the system does not tell.
std::uint64_t free_memory();
/// Resident bytes of this process; 0 if the system does not tell.
std::uint64_t used_memory();

/// Workers of `worker_bytes` each, at most `threads`, that fit into `memory` bytes (0: half of what
/// is free, on top of what is in use) beside the `used` ones. Throws Error{invalid_argument} naming
/// both sizes if not even one does.
int workers_that_fit(std::uint64_t memory, std::uint64_t used, std::uint64_t worker_bytes,
                     int threads);

}  // namespace haarlight
