// Is arithmetic what results rest on?

#pragma once

namespace haarlight {

/// Throws Error{missing} unless floats and doubles behave as IEEE 754 says on this thread: rounding
/// to nearest, NaN unequal to itself, denormals kept, no excess precision. A library built with
/// fast-math changes that for the whole process when it is loaded, and sums, gates and orders would
/// be wrong without a sign of it; programs call this when they start.
void check_float_arithmetic();

}  // namespace haarlight
