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

  /// Of another part of the same frame.
  void add(const RelightStats& part) {
    apply.transport_bytes += part.apply.transport_bytes;
    apply.sum_bytes += part.apply.sum_bytes;
    apply.columns += part.apply.columns;
    apply_ms += part.apply_ms;
    finish_ms += part.finish_ms;
  }
};

}  // namespace haarlight
