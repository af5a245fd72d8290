#pragma once

#include <string>

#include "render/image.h"

namespace medulla {

// A line of text in the upper left corner of a finished picture, on dark paper. A line that is too long for `width`
// (pixels, at most the picture's) is written smaller; where no letter could be read (less than 5 rows high) it is
// broken into several, and left out where these would not fit or take a third of the picture: false.
bool drawCaption(const std::string& text, int width, Image& image);

}  // namespace medulla
