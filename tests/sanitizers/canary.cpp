// Faults that a sanitizer must find, and work that it must not complain of: a build whose sanitizer
// is blind would call everything clean.
//
//   canary race | clean-loop | overflow | overflow-int | clean

#include <cstdio>
#include <cstring>
#include <limits>
#include <vector>

#include "core/parallel.h"

int main(int argc, char** argv) {
  const char* kind = argc == 2 ? argv[1] : "";
  constexpr int kCount = 100'000;
  std::vector<int> own(kCount, 0);
  haarlight::set_thread_count(4);
  if (std::strcmp(kind, "race") == 0) {
    int shared = 0;
    haarlight::parallel_for(kCount, [&](int i) { shared += i; });
    std::printf("%d\n", shared);
  } else if (std::strcmp(kind, "clean-loop") == 0) {
    // Two loops one after the other: the second reads what other threads wrote in the first.
    haarlight::parallel_for(kCount, [&](int i) { own[static_cast<std::size_t>(i)] = i; });
    std::vector<int> sums(kCount, 0);
    haarlight::parallel_for(kCount, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      sums[at] = own[at] + own[kCount - 1 - at];
    });
    std::printf("%d\n", sums[7]);
  } else if (std::strcmp(kind, "overflow") == 0) {
    const volatile std::size_t past = own.size();
    std::printf("%d\n", own.data()[past]);
  } else if (std::strcmp(kind, "overflow-int") == 0) {
    volatile int most = std::numeric_limits<int>::max();
    std::printf("%d\n", most + argc);
  } else {
    std::printf("%d\n", own[3]);
  }
  return 0;
}
