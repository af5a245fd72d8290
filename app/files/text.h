#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

// Words and lists of words for those who read them: people, shells, XML.
namespace medulla {

// A word as it may appear in an error message: between marks, shortened, and on one line.
std::string inQuotes(std::string_view word, char mark = '\'');

// Quoted where a shell would take it for several words or more: for commands that are printed to be pasted.
std::string shellWord(std::string_view word);

// Letters: so that files may be named after a name, with what is put before and behind. Of longer words, which may be
// files without an end, no more is compared with names.
inline constexpr std::size_t kLongestName = 200;

// A name for results, curves, bodies and scenes, of what may be any: letters, digits, _ and - of it, _ for the rest.
std::string plainName(std::string_view text);

// As an attribute's value, or between tags.
std::string escapedXml(std::string_view text);

// Without the white space at its ends: blanks, tabs, ends of lines.
std::string_view trimmed(std::string_view text);

// The first word of `rest`, taken off it with the white space before; empty where there is none.
std::string_view takeWord(std::string_view& rest);

// Letters of ASCII alone, whatever the locale.
std::string lowered(std::string_view text);

// The known name with the fewest edits (insert, delete, replace, swap neighbours), whatever the case of letters, the
// first among equals; "" of none.
std::string nearestName(const std::string& name, const std::vector<std::string>& known);

// The same as a hint, 'did you mean "a"?', or, where none is alike, 'expected one of a, b, c'; "" where none is known.
std::string hintOfNames(const std::string& name, const std::vector<std::string>& known);

// For short lists, which are named whole: 'did you mean "a"? known: a, b, c', or 'expected one of a, b, c'.
std::string hintAndNames(const std::string& name, const std::vector<std::string>& known);

// Whether a word is among others.
template <class Words>
bool isOneOf(std::string_view word, const Words& words) {
  return std::find(std::begin(words), std::end(words), word) != std::end(words);
}

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
