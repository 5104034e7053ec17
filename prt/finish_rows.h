// Sums of rows become outputs: pixels, vertices. Private to prt/.

#pragma once

#include <span>

#include "core/rgb.h"
#include "prt/lighting_update.h"
#include "prt/relight_stats.h"
#include "prt/row_sums.h"

namespace haarlight {

/// Applies an update to `sums` and writes the coloured sums of every chunk that changed to
/// `outputs`, transport.info().output_count() of them; of a first part, nothing.
RelightStats apply_and_finish(RowSums& sums, const LightingUpdate& update, std::span<Rgb> outputs,
                              UpdatePart part = UpdatePart::whole);

/// The update that shows all of `lighting` where nothing was shown. Throws
/// Error{invalid_argument} unless it is layout.size() coefficients.
LightingUpdate full_update(const HaarLayout& layout, std::span<const Rgb> lighting);

}  // namespace haarlight
