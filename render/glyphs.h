#pragma once

#include <glm/glm.hpp>
#include <string_view>
#include <vector>

// The letters of captions and charts: ASCII, and what the languages of Europe that are written in Latin letters add.
namespace medulla {

// Strokes between points of a grid, x 0..9 to the right and y 0..8 downwards: capitals from 0 to 6, small letters from
// 2 to 6, tails to 8. A blank lifts the pen.
struct Glyph {
  char32_t character;
  float advance;
  const char* strokes;
};

struct Letter {
  const Glyph* glyph;
  const char* mark = "";  // an accent's strokes,
  float markStep = 1;     // on a grid that is so wide,
  glm::vec2 markAt{0};    // moved by so much of the glyph's
};

// Of UTF-8, in order; what nobody draws is an empty box.
std::vector<Letter> lettersOf(std::string_view text);
std::string_view firstUndrawn(std::string_view text);  // the first such character; empty: there is none

}  // namespace medulla
