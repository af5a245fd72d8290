#pragma once

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

}  // namespace medulla
