#pragma once

#include <cstdint>
#include <vector>

#include "render/image.h"

namespace medulla {

// RGB to planar 4:2:0 (I420: Y, then U, then V at half size), BT.709, limited range (Y 16..235, chroma 16..240):
// what an H.264 file tagged bt709/tv must carry. Chroma is the mean of 2x2 pixels. Width and height even.
// Doing it here saves FFmpeg's slower scaler, and what waits for the encoder is less than half as large.
void rgbaToI420(const Image& image, std::vector<std::uint8_t>& out);

}  // namespace medulla
