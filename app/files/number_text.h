#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

// Numbers as text, both ways, the same in every locale (std::from_chars and std::to_chars know none).
namespace medulla {

// The whole of `text` as a finite number: a leading + is allowed; nothing else around it, no hexadecimal, no NaN, no
// infinity, no overflow. Empty otherwise. T: an integer, float or double.
template <typename T>
std::optional<T> parseNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return value;
}

// The shortest text that reads back as the same bits (at most 17 significant digits for double, 9 for float).
template <typename T>
void appendNumber(std::string& out, T value) {
  char digits[32];
  out.append(digits, std::to_chars(digits, digits + sizeof(digits), value).ptr);
}

}  // namespace medulla
