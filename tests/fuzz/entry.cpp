// libFuzzer's entry for one of tests/fuzz/targets.h: HAARLIGHT_FUZZ_TARGET.

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  haarlight::fuzz::HAARLIGHT_FUZZ_TARGET({reinterpret_cast<const std::byte*>(data), size});
  return 0;
}
