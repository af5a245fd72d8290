#pragma once

#include <functional>
#include <memory>
#include <string>

struct AVFrame;

namespace medulla {

// The 256 colours of a film and its pictures in them: FFmpeg's filters palettegen and paletteuse, one after the other.
class FilmPalette {
 public:
  // `frame`: what the pictures are like. `folder`: where a file without a name keeps them
  // while they wait.
  FilmPalette(const AVFrame& frame, const std::string& folder);
  ~FilmPalette();
  void add(AVFrame& frame);  // of 4:2:0 planes without gaps
  // Hands on each picture in its turn, as palette and indices; before each it calls `goOn`, which may throw.
  void finish(const std::function<void(AVFrame&)>& take, const std::function<void()>& goOn);

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
