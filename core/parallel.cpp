// How many threads parallel loops use.

#include "core/parallel.h"

#include <omp.h>

#include <string>

#include "core/error.h"

namespace haarlight {

void set_thread_count(int threads) {
  if (threads < 1) {
    throw Error(ErrorKind::invalid_argument,
                "thread count is " + std::to_string(threads) + ", expected at least 1");
  }
  omp_set_num_threads(threads);
}

int thread_count() { return omp_get_max_threads(); }

}  // namespace haarlight
