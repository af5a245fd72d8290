#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

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

  void push(const Fill& fill);         // throws std::runtime_error with the words of an earlier failure
  void finish();                       // once all are encoded; throws likewise
  void stop();                         // what still waits is not encoded
  StageTimes::Stage encoding() const;  // what the thread has taken, up to its last picture

 private:
  void work();
  void end();
  void rethrow() const;

  Encode encode_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> waiting_, spare_;
  bool ended_ = false, abandoned_ = false;
  std::string failure_;  // why it stopped; empty: it has not
  StageTimes::Stage encoding_{"encode", 0, 0};
  std::thread thread_;  // last: it begins at once
};

}  // namespace medulla
