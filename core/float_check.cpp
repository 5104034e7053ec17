// Is arithmetic what results rest on?

#include "core/float_check.h"

#include <cmath>
#include <limits>
#include <string>

#include "core/error.h"

#if defined(__FAST_MATH__)
#error "fast-math is on: NaN would pass the gates and sums would not be what is proved of them"
#endif

namespace haarlight {

void check_float_arithmetic() {
  const auto require = [](bool holds, const char* what) {
    if (holds) return;
    throw Error(ErrorKind::missing,
                std::string("floating-point arithmetic ") + what +
                    ", expected IEEE 754: a library in this process was built with fast-math");
  };
  // Volatile: computed now, by the machine as it is set, not by the compiler.
  volatile float tiny = std::numeric_limits<float>::min(), half = 0.5f;
  volatile float denormal = std::numeric_limits<float>::denorm_min();
  volatile double tiny_double = std::numeric_limits<double>::min();
  volatile float nan = std::numeric_limits<float>::quiet_NaN();
  volatile double one = 1, ulp = 0x1p-52;
  const float halved = tiny * half, doubled = denormal + denormal;
  const double halved_double = tiny_double * 0.5;
  require(halved != 0 && halved_double != 0, "flushes denormals to zero");
  require(doubled != 0, "takes denormals as zero");
  const float not_a_number = nan + half;
  require(std::isnan(not_a_number) && !(not_a_number == not_a_number) && !(not_a_number >= 0),
          "takes NaN for a number");
  // Ties to even, from both sides, in both signs.
  const double up = one + 0.75 * ulp, down = one + 0.25 * ulp, tie = one + 0.5 * ulp;
  const double minus_up = -one - 0.75 * ulp, minus_down = -one - 0.25 * ulp;
  require(
      up == 1 + 0x1p-52 && down == 1 && tie == 1 && minus_up == -1 - 0x1p-52 && minus_down == -1,
      "does not round to nearest");
}

}  // namespace haarlight
