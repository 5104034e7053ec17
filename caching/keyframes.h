// A value that changes along keys in time: glTF 2.0, section 3.11 and appendix C.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace haarlight {

enum class Interpolation { step, linear, cubic };

/// Keys of a value of `width` numbers.
struct Keyframes {
  std::vector<double> time;   ///< seconds, strictly ascending, at least one
  std::vector<double> value;  ///< width a key; cubic: in-tangent, value, out-tangent, 3 width a key
  std::size_t width = 1;
  Interpolation interpolation = Interpolation::linear;
  bool rotation = false;  ///< a unit quaternion (x, y, z, w): turned along the shorter arc

  /// The value at `seconds`, before the first key the first, after the last the last. `out` has
  /// `width` numbers. Requires value.size() == time.size() * width (cubic: times 3).
  void at(double seconds, std::span<double> out) const;
};

}  // namespace haarlight
