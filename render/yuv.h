#pragma once

#include <cstdint>
#include <vector>

#include "render/image.h"

namespace medulla {

// BT.709 is what a file must carry that is tagged so; BT.601 what WebP is, which has no tag for it.
enum class YuvMatrix { bt709, bt601 };

// RGB to planar 4:2:0 (I420: Y, then U, then V at half size), limited range (Y 16..235, chroma 16..240). Chroma is the
// mean of 2x2 pixels. Width and height even.
// Doing it here saves FFmpeg's slower scaler, and what waits for the encoder is less than half as large.
void rgbaToI420(const Image& image, YuvMatrix matrix, std::vector<std::uint8_t>& out);

}  // namespace medulla
