// A 5 x 7 bitmap font of the few letters that axis labels need.

#pragma once

#include <string_view>

namespace haarlight::data_gen {

inline constexpr int kGlyphWidth = 5, kGlyphHeight = 7;
inline constexpr int kGlyphAdvance = 6;  ///< a glyph and the gap after it

/// Is the cell in `column` (0 = left) and `row` (0 = top) of `letter` inked? False outside the
/// glyph and for letters the font lacks; it has A B C D E F G H I K L N O P R T U W X Y Z + -.
bool glyph_cell(char letter, int column, int row);

/// The same for a line of text; its width is text.size() * kGlyphAdvance - 1 cells.
bool text_cell(std::string_view text, int column, int row);

}  // namespace haarlight::data_gen
