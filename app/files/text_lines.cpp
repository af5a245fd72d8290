#include "app/files/text_lines.h"

#include <algorithm>
#include <optional>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"

namespace medulla {

std::string_view takeLine(std::string_view& rest) {
  const auto endsLine = [](char c) { return c == '\n' || c == '\r'; };
  const auto length = static_cast<std::size_t>(std::find_if(rest.begin(), rest.end(), endsLine) - rest.begin());
  const std::string_view line = rest.substr(0, length);
  rest.remove_prefix(length);
  rest.remove_prefix(rest.starts_with("\r\n") ? 2 : std::min<std::size_t>(rest.size(), 1));
  return line;
}

// True when the line is continued on the next one.
bool TextLines::splitLine() {
  std::string_view text = takeLine(rest_);
  ++line_;
  const std::size_t comment = text.find('#');
  text = trimmed(text.substr(0, comment));
  const bool continued = joined_ && comment == std::string_view::npos && text.ends_with('\\');
  if (continued) text.remove_suffix(1);
  for (std::string_view word = takeWord(text); !word.empty(); word = takeWord(text)) words_.push_back(word);
  return continued;
}

bool TextLines::next() {
  words_.clear();
  while (!rest_.empty()) {
    const bool continued = splitLine();
    if (!words_.empty() && !continued) return true;
  }
  return !words_.empty();
}

double TextLines::number(std::string_view word) const {
  const std::optional<double> value = parseNumber<double>(word);
  if (!value) fail("expected a finite number, found " + inQuotes(word));
  return *value;
}

long long TextLines::integer(std::string_view word) const {
  const std::optional<long long> value = parseNumber<long long>(word);
  if (!value) fail("expected an integer, found " + inQuotes(word));
  return *value;
}

void TextLines::fail(const std::string& message) const {
  throw inputError(name_, line_, message);
}

}  // namespace medulla
