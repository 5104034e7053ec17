// Keeping loops over floats fast where light all but vanishes.

#pragma once

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace haarlight {

/// While it lives, floats below 1.2e-38 count as 0 on this thread: some processors take a hundred
/// times longer over them. Put it into the body of a parallel loop, as each thread has its own
/// setting; the caller's comes back at the end. Where the machine has no such setting nothing
/// happens. For loops whose results mean radiance, so that less than 1.2e-38 is nothing.
class FlushDenormals {
 public:
#if defined(__SSE__)
  FlushDenormals() : before_(_mm_getcsr()) {
    constexpr unsigned kFlushToZero = 0x8000, kDenormalsAreZero = 0x0040;
    _mm_setcsr(before_ | kFlushToZero | kDenormalsAreZero);
  }
  ~FlushDenormals() { _mm_setcsr(before_); }

 private:
  unsigned before_;
#else
  FlushDenormals() {}
  ~FlushDenormals() {}
#endif
 public:
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;
};

}  // namespace haarlight
