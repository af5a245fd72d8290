#include "render/picture_queue.h"

#include <cassert>
#include <stdexcept>
#include <utility>

namespace medulla {
namespace {

// Enough that neither side waits for the other's jitter; more only costs memory (1.4 MB each of a video of 720p).
constexpr std::size_t kQueued = 3;

}  // namespace

PictureQueue::PictureQueue(Encode encode) : encode_(std::move(encode)), spare_(kQueued), thread_([this] { work(); }) {}

PictureQueue::~PictureQueue() {
  stop();
}

void PictureQueue::stop() {
  {
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
  }
  end();
}

void PictureQueue::end() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void PictureQueue::work() {
  for (;;) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || !waiting_.empty(); });
    if (waiting_.empty() || abandoned_) return;
    Entry entry = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const double start = wallSeconds();
    std::string failure;
    try {
      encode_(entry);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    lock.lock();
    encoding_.wall += wallSeconds() - start;
    encoding_.cpu = threadCpuSeconds();
    spare_.push_back(std::move(entry));
    failure_ = failure;
    lock.unlock();
    changed_.notify_all();
    if (!failure.empty()) return;
  }
}

void PictureQueue::rethrow() const {
  if (!failure_.empty()) throw std::runtime_error(failure_);
}

void PictureQueue::push(const Fill& fill) {
  std::unique_lock lock(mutex_);
  assert(!ended_);
  changed_.wait(lock, [this] { return !failure_.empty() || !spare_.empty(); });
  rethrow();
  Entry entry = std::move(spare_.front());
  spare_.pop_front();
  lock.unlock();
  fill(entry);
  lock.lock();
  waiting_.push_back(std::move(entry));
  lock.unlock();
  changed_.notify_all();
}

void PictureQueue::finish() {
  end();
  rethrow();
}

StageTimes::Stage PictureQueue::encoding() const {
  const std::lock_guard lock(mutex_);
  return encoding_;
}

}  // namespace medulla
