#pragma once

#include <memory>
#include <string>

#include "render/image.h"

namespace medulla {

// An mp4 (H.264) through the ffmpeg program. The file grows beside its target under a name of its own and is renamed by
// finish(); a writer destroyed before that leaves nothing.
class VideoWriter {
 public:
  // Throws std::runtime_error when ffmpeg is not installed or the folder cannot be written. Width and height even.
  VideoWriter(const std::string& path, int width, int height, double fps);
  ~VideoWriter();
  VideoWriter(VideoWriter&&) noexcept;
  void write(const Image& image);  // throws when ffmpeg died, with what it said
  void finish();

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
