// A 5 x 7 bitmap font, drawn so that a reader sees each letter.

#include "data_gen/bitmap_font.h"

#include <cstddef>

namespace haarlight::data_gen {
namespace {

// Seven rows of five cells.
std::string_view glyph(char letter) {
  switch (letter) {
    case 'A':
      return ".###. #...# #...# ##### #...# #...# #...#";
    case 'B':
      return "####. #...# #...# ####. #...# #...# ####.";
    case 'C':
      return ".#### #.... #.... #.... #.... #.... .####";
    case 'D':
      return "####. #...# #...# #...# #...# #...# ####.";
    case 'E':
      return "##### #.... #.... ####. #.... #.... #####";
    case 'F':
      return "##### #.... #.... ####. #.... #.... #....";
    case 'G':
      return ".#### #.... #.... #..## #...# #...# .####";
    case 'H':
      return "#...# #...# #...# ##### #...# #...# #...#";
    case 'I':
      return ".###. ..#.. ..#.. ..#.. ..#.. ..#.. .###.";
    case 'K':
      return "#...# #..#. #.#.. ##... #.#.. #..#. #...#";
    case 'L':
      return "#.... #.... #.... #.... #.... #.... #####";
    case 'N':
      return "#...# ##..# ##..# #.#.# #..## #..## #...#";
    case 'O':
      return ".###. #...# #...# #...# #...# #...# .###.";
    case 'P':
      return "####. #...# #...# ####. #.... #.... #....";
    case 'R':
      return "####. #...# #...# ####. #.#.. #..#. #...#";
    case 'T':
      return "##### ..#.. ..#.. ..#.. ..#.. ..#.. ..#..";
    case 'U':
      return "#...# #...# #...# #...# #...# #...# .###.";
    case 'W':
      return "#...# #...# #...# #.#.# #.#.# ##.## #...#";
    case 'X':
      return "#...# #...# .#.#. ..#.. .#.#. #...# #...#";
    case 'Y':
      return "#...# #...# .#.#. ..#.. ..#.. ..#.. ..#..";
    case 'Z':
      return "##### ....# ...#. ..#.. .#... #.... #####";
    case '+':
      return "..... ..#.. ..#.. ##### ..#.. ..#.. .....";
    case '-':
      return "..... ..... ..... ##### ..... ..... .....";
    default:
      return {};
  }
}

}  // namespace

bool glyph_cell(char letter, int column, int row) {
  if (column < 0 || column >= kGlyphWidth || row < 0 || row >= kGlyphHeight) return false;
  const std::string_view cells = glyph(letter);
  const auto place = static_cast<std::size_t>(row * (kGlyphWidth + 1) + column);
  return place < cells.size() && cells[place] == '#';
}

bool text_cell(std::string_view text, int column, int row) {
  if (column < 0) return false;
  const auto letter = static_cast<std::size_t>(column / kGlyphAdvance);
  return letter < text.size() && glyph_cell(text[letter], column % kGlyphAdvance, row);
}

}  // namespace haarlight::data_gen
