#pragma once

#include <functional>
#include <memory>
#include <string>

#include "render/image.h"
#include "render/stage_times.h"

namespace medulla {

// Whether a file of this name is a video: .mp4 (H.264), .webm (VP9), .gif or .webp (animated, repeating for ever).
bool isVideoName(const std::string& path);

// A video through FFmpeg's libraries, of the kind that its name says. The file grows beside its target under a name of
// its own and is renamed by commit(); a writer destroyed before that leaves nothing.
class VideoWriter {
 public:
  // Throws std::runtime_error when the file cannot be written, the size is odd (colours are stored for 2x2 pixels at
  // once), or more pictures per second are asked for than players show: of a GIF, whose times are hundredths of a
  // second, more than 50, of a WebP, whose are thousandths, more than 90. They take 0.01 s and less for 0.1.
  VideoWriter(const std::string& path, int width, int height, double fps);
  ~VideoWriter();
  VideoWriter(VideoWriter&&) noexcept;
  void write(const Image& image);  // throws, with the reason, when an earlier one could not be written
  // Calls `goOn` before each picture that is still to be encoded: a GIF is from first to last. What it throws, any but
  // a std::runtime_error, ends the film unfinished and comes through.
  void finish(const std::function<void()>& goOn = [] {});
  void commit();                              // once, last: gives the film its name
  const StageTimes::Stage& encoding() const;  // what its thread has taken; after finish()

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
