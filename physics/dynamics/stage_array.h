#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

// What one stage of a substep leaves for the next ones of the same batch.
namespace medulla {

// Indexed like the world's other arrays, by group, link or node. While a batch runs whose intermediate results nobody
// reads later, its entries lie in one buffer that all batches reuse: it stays in a core's own cache, where arrays of a
// whole world would be fetched and written back in every substep, more than half of all that a large world moves.
template <class T>
class StageArray {
 public:
  StageArray() = default;
  StageArray(const StageArray&) = delete;  // `at_` points into the original
  StageArray& operator=(const StageArray&) = delete;

  // New places are zero.
  void resize(std::size_t count) {
    whole_.resize(count);
    at_ = whole_.data();
  }
  // Makes room for batches of up to this many.
  void reserveShared(std::size_t count) {
    if (shared_.size() < count) shared_.resize(count);
  }

  // From now on place `first` is the first one of the shared memory.
  void useShared(std::size_t first) {
    // As an integer: a pointer before the memory's beginning is not defined.
    const std::uintptr_t place = reinterpret_cast<std::uintptr_t>(shared_.data()) - first * sizeof(T);
    at_ = reinterpret_cast<T*>(place);  // NOLINT(performance-no-int-to-ptr)
  }
  void useWhole() { at_ = whole_.data(); }

  T& operator[](std::size_t i) { return at_[i]; }
  const T& operator[](std::size_t i) const { return at_[i]; }
  T* data() { return at_; }
  const T* data() const { return at_; }

 private:
  std::vector<T> whole_, shared_;
  T* at_ = nullptr;
};

}  // namespace medulla
