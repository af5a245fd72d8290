#pragma once

#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "render/bounded_buffer.h"
#include "render/stage_times.h"

namespace medulla {

// Pictures that wait for a thread which encodes them, so that encoding overlaps drawing. Memory is used again.
class PictureQueue {
 public:
  struct Entry {
    int number = 0, width = 0, height = 0;
    std::vector<std::uint8_t> bytes;  // as who fills it in and who encodes it agree
  };
  using Fill = std::function<void(Entry&)>;
  using Encode = std::function<void(Entry&)>;

  explicit PictureQueue(Encode encode);  // called in the thread; what it throws ends the work
  ~PictureQueue();                       // stops
  PictureQueue(const PictureQueue&) = delete;
  PictureQueue& operator=(const PictureQueue&) = delete;

  void push(const Fill& fill);                                     // throws what ended the work
  void finish();                                                   // once all are encoded; throws likewise
  void stop();                                                     // what still waits is not encoded
  const StageTimes::Stage& encoding() const { return encoding_; }  // what the thread has taken; once it has ended

 private:
  void work();

  Encode encode_;
  BoundedBuffer<Entry> entries_;
  StageTimes::Stage encoding_{"encode", 0, 0};
  std::thread thread_;  // last: it begins at once
};

}  // namespace medulla
