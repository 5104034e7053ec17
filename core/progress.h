// How long work tells its caller how far it is, and is told to stop.

#pragma once

#include <functional>

namespace haarlight {

/// Called with the share done, in [0, 1] and never falling, never from two threads at once. Return
/// false to stop: the call under way then throws Error{cancelled}. May be empty.
using Progress = std::function<bool(double share)>;

}  // namespace haarlight
