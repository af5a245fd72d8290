#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "render/yuv.h"

namespace medulla {

enum class VideoFormat { mp4, webm, gif, webp };

// What VideoEncoder::write() wants.
inline YuvMatrix matrixOf(VideoFormat format) {
  return format == VideoFormat::webp ? YuvMatrix::bt601 : YuvMatrix::bt709;
}

// One video file, by FFmpeg's libraries. A GIF has one palette for the whole film (with one per picture it is ten times
// as large), so that its pictures wait in a file beside it, which nobody sees, until the last has come.
class VideoEncoder {
 public:
  // Width and height even, fps > 0. All functions throw std::runtime_error with the reason alone.
  VideoEncoder(VideoFormat format, const std::string& path, int width, int height, double fps);
  VideoEncoder(VideoEncoder&&) noexcept;
  ~VideoEncoder();
  void write(std::vector<std::uint8_t>& planes);   // as rgbaToI420() makes them by matrixOf(); not changed
  void finish(const std::function<void()>& goOn);  // called before each picture that is left; may throw

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
