#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace medulla {

// The ffmpeg program as a child that reads I420 pictures from a pipe and writes an mp4 to `path`.
class EncoderProcess {
 public:
  // Throws std::runtime_error when ffmpeg is not installed or cannot be started.
  EncoderProcess(const std::string& path, int width, int height, double fps);
  ~EncoderProcess();  // kills the child if it still runs
  EncoderProcess(const EncoderProcess&) = delete;
  EncoderProcess& operator=(const EncoderProcess&) = delete;

  bool write(const std::vector<std::uint8_t>& bytes);  // false when the child has gone; SIGPIPE must be blocked
  bool finish();                                       // end of input; waits; true when the child succeeded
  std::string complaint() const;                       // last line the child wrote to its standard error

 private:
  int input_ = -1, errors_ = -1;
  pid_t child_ = -1;
};

}  // namespace medulla
