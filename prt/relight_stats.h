// What relighting one frame cost.

#pragma once

#include "prt/row_sums.h"

namespace haarlight {

/// Time and traffic of one frame.
struct RelightStats {
  ApplyStats apply;
  double apply_ms = 0;   ///< streaming columns into sums
  double finish_ms = 0;  ///< sums to outputs, done chunk by chunk while they are in cache; both are
                         ///< shares of the frame's wall time. Drawing a mesh counts here too
};

}  // namespace haarlight
