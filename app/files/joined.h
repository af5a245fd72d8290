#pragma once

#include <string>
#include <string_view>

namespace medulla {

// "a, b, c". By hand: g++ 12 sees an overflow in fmt::join where there is none.
template <class Names>
std::string joined(const Names& names, std::string_view separator) {
  std::string out;
  for (const auto& name : names) {
    if (!out.empty()) out += separator;
    out += name;
  }
  return out;
}

}  // namespace medulla
