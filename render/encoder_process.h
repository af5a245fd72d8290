#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace medulla {

// What a video is: how ffmpeg makes it. gif keeps the whole film in memory until its end, for a palette that suits all
// of it: with one per picture the file is ten times as large.
enum class VideoFormat { mp4, webm, gif, webp };

// The ffmpeg program as a child that reads I420 pictures from a pipe and writes a video to `path`.
class EncoderProcess {
 public:
  // Throws std::runtime_error when ffmpeg is not installed or cannot be started.
  EncoderProcess(VideoFormat format, const std::string& path, int width, int height, double fps);
  ~EncoderProcess();  // kills the child if it still runs
  EncoderProcess(const EncoderProcess&) = delete;
  EncoderProcess& operator=(const EncoderProcess&) = delete;

  bool write(const std::vector<std::uint8_t>& bytes);  // false when the child has gone; SIGPIPE must be blocked
  bool finish();                  // end of input; waits; true when the child succeeded without a complaint
  std::string complaint() const;  // last line the child wrote to its standard error; empty where it wrote none

 private:
  int input_ = -1, errors_ = -1;
  pid_t child_ = -1;
};

}  // namespace medulla
