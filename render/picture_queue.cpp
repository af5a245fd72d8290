#include "render/picture_queue.h"

#include <cstddef>
#include <exception>
#include <optional>
#include <utility>

namespace medulla {
namespace {

// Enough that neither side waits for the other's jitter; more only costs memory (1.4 MB each of a video of 720p).
constexpr std::size_t kQueued = 3;

}  // namespace

PictureQueue::PictureQueue(Encode encode)
    : encode_(std::move(encode)), entries_(kQueued), thread_([this] { work(); }) {}

PictureQueue::~PictureQueue() {
  stop();
}

void PictureQueue::work() {
  try {
    while (std::optional<Entry> entry = entries_.next()) {
      const double start = wallSeconds();
      encode_(*entry);
      encoding_.wall += wallSeconds() - start;
      entries_.giveBack(std::move(*entry));
    }
  } catch (...) {
    entries_.fail(std::current_exception());
  }
  encoding_.cpu = threadCpuSeconds();
}

void PictureQueue::push(const Fill& fill) {
  Entry entry = entries_.take();
  fill(entry);
  entries_.give(std::move(entry));
}

void PictureQueue::finish() {
  entries_.end();
  if (thread_.joinable()) thread_.join();
  entries_.rethrow();
}

void PictureQueue::stop() {
  entries_.abandon();
  if (thread_.joinable()) thread_.join();
}

}  // namespace medulla
