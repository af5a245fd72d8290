#pragma once

#include <cstdint>
#include <vector>

#include "render/looks.h"

namespace medulla {

// Tileable RGBA, detail.side^2: red = mottling, green = vessels, blue and alpha = slope of the relief along u and v
// (0.5 is flat). `seed` tells looks with the same pattern apart.
std::vector<std::uint8_t> makeDetailTexture(const DetailPattern& pattern, int seed);

}  // namespace medulla
