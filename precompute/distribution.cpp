// Other processes that take part in a run.

#include "precompute/distribution.h"

#include <exception>

#include "core/error.h"

namespace haarlight {

void together(Distribution* distribution, const std::function<void()>& work) {
  if (!distribution) {
    work();
    return;
  }
  std::string message;
  std::exception_ptr failed;
  try {
    work();
  } catch (const std::exception& error) {
    message = error.what();
    failed = std::current_exception();
  }
  message = distribution->agree(message);
  if (failed) std::rethrow_exception(failed);
  if (!message.empty()) throw Error(ErrorKind::io, message);
}

}  // namespace haarlight
