#pragma once

#include <array>
#include <atomic>

namespace medulla {

// Hands the newest of a series of states from one writing thread to one reading thread. Neither ever waits, locks or
// allocates: of three slots one is written, one is read, and the third changes hands by one atomic exchange. The reader
// may miss states, never sees one half written, and keeps its own until it takes the next.
template <typename T>
class TripleBuffer {
 public:
  TripleBuffer() = default;
  explicit TripleBuffer(std::array<T, 3> slots) : slots_(std::move(slots)) {}

  // Writer's.
  T& writing() { return slots_[writing_]; }
  void publish() { writing_ = spare_.exchange(writing_ | isNew, std::memory_order_acq_rel) & slot; }

  // Reader's. take() returns false, and reading() stays what it was, when nothing was published since the last.
  bool take() {
    if (!(spare_.load(std::memory_order_relaxed) & isNew)) return false;
    reading_ = spare_.exchange(reading_, std::memory_order_acq_rel) & slot;
    return true;
  }
  T& reading() { return slots_[reading_]; }
  const T& reading() const { return slots_[reading_]; }

 private:
  static constexpr unsigned slot = 3, isNew = 4;
  std::array<T, 3> slots_;
  unsigned writing_ = 0, reading_ = 1;
  std::atomic<unsigned> spare_{2};
};

}  // namespace medulla
