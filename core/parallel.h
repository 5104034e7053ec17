// Parallel loops over OpenMP.

#pragma once

#include <atomic>
#include <exception>

namespace haarlight {

/// body(i) for every i in [0, count), spread over the OpenMP threads, each i exactly once and by
/// one thread. Results must not depend on which thread runs an i or in which order: every i owns
/// what it writes. The first exception thrown by a body is thrown again here, after the rest ended
/// early. `chunk` consecutive i go to a thread at a time; where that is all of them no other thread
/// is woken, which on a busy machine costs more than a small loop does.
template <typename Body>
void parallel_for(int count, const Body& body, int chunk = 1) {
  if (count <= chunk) {
    for (int i = 0; i < count; ++i) body(i);
    return;
  }
  std::exception_ptr failure;
  std::atomic<bool> stop{false};
#pragma omp parallel for schedule(dynamic, chunk)
  for (int i = 0; i < count; ++i) {
    if (stop.load(std::memory_order_relaxed)) continue;
    try {
      body(i);
    } catch (...) {
#pragma omp critical(haarlight_parallel_for)
      if (!failure) failure = std::current_exception();
      stop.store(true, std::memory_order_relaxed);
    }
  }
  if (failure) std::rethrow_exception(failure);
}

/// Number of threads parallel_for uses from here on (OpenMP's setting); >= 1.
void set_thread_count(int threads);
int thread_count();

}  // namespace haarlight
