#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace medulla {

// What the system calls an open file, closed with its owner.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}  // -1: none
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }

  int value() const { return value_; }
  bool isOpen() const { return value_ >= 0; }
  bool close();  // before its owner goes: false, with errno, where the system has not taken all that was written

 private:
  int value_;
};

// All of it, where the system takes less at a time. Throws unwritable() of `path` (partial_file.h).
void writeAll(const Descriptor& to, std::string_view bytes, const std::string& path);

}  // namespace medulla
