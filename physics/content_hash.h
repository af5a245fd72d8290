#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string_view>

namespace medulla {

// FNV-1a over bytes, going on from `start`: what tells one input from another. No protection against forgery.
inline std::uint64_t contentHash(std::string_view bytes, std::uint64_t start = 0xcbf29ce484222325ULL) {
  for (const char c : bytes) {
    start ^= static_cast<unsigned char>(c);
    start *= 0x100000001b3ULL;
  }
  return start;
}

// Of numbers one after the other, by their bits.
class NumberHash {
 public:
  void add(double x) { add(std::bit_cast<std::uint64_t>(x)); }
  void add(std::uint64_t x) {
    const auto bytes = std::bit_cast<std::array<char, sizeof x>>(x);
    value_ = contentHash({bytes.data(), bytes.size()}, value_);
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = contentHash({});
};

}  // namespace medulla
