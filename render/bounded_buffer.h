#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

namespace medulla {

// Things on their way from a thread that fills them to one that empties them, in order. There are so many and no more:
// who fills waits while all are under way, and their memory is used again.
template <typename Thing>
class BoundedBuffer {
 public:
  explicit BoundedBuffer(std::size_t count) : spare_(count) {}

  // Who fills.
  Thing take() {  // one that is empty; rethrows why there is nobody left who empties
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return failure_ || !spare_.empty(); });
    if (failure_) std::rethrow_exception(failure_);
    return popped(spare_);
  }
  void give(Thing filled) {
    tell([&] { waiting_.push_back(std::move(filled)); });
  }
  void end() {  // that was the last
    tell([&] { ended_ = true; });
  }
  void abandon() {  // and what waits need not be emptied
    tell([&] { ended_ = abandoned_ = true; });
  }
  void rethrow() {  // like take
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
  }

  // Who empties.
  std::optional<Thing> next() {  // waits for it; nothing: there are no more
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (abandoned_ || waiting_.empty()) return std::nullopt;
    return popped(waiting_);
  }
  void giveBack(Thing emptied) {
    tell([&] { spare_.push_back(std::move(emptied)); });
  }
  void fail(std::exception_ptr failure) {  // empties no more
    tell([&] { failure_ = std::move(failure); });
  }
  bool abandoned() {
    const std::lock_guard lock(mutex_);
    return abandoned_;
  }

 private:
  template <typename Change>
  void tell(const Change& change) {
    {
      const std::lock_guard lock(mutex_);
      change();
    }
    changed_.notify_all();
  }
  static Thing popped(std::deque<Thing>& things) {
    Thing thing = std::move(things.front());
    things.pop_front();
    return thing;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Thing> waiting_, spare_;
  bool ended_ = false, abandoned_ = false;
  std::exception_ptr failure_;
};

}  // namespace medulla
