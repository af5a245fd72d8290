#include "app/files/text.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace medulla {

// On one line, without what terminals obey.
static std::string shortened(std::string_view word) {
  constexpr std::size_t kLongest = 60;
  std::size_t length = std::min(kLongest, word.size());
  if (length < word.size())
    while (length > 0 && (word[length] & 0xC0) == 0x80) --length;  // not within a letter of UTF-8
  std::string out;
  for (const char c : word.substr(0, length)) {
    const bool blank = c == '\n' || c == '\t' || c == '\r', control = static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    out += blank ? ' ' : control ? '?' : c;
  }
  if (length < word.size()) out += "...";
  return out;
}

std::string inQuotes(std::string_view word, char mark) {
  return mark + shortened(word) + mark;
}

std::string shellWord(std::string_view word) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/._-+,=@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) return std::string(word);
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string plainName(std::string_view text) {
  const auto isPlain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  std::string out(text);
  for (char& c : out)
    if (!isPlain(c)) c = '_';
  return out;
}

std::string escapedXml(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  return out;
}

static constexpr std::string_view kBlank = " \t\r\n";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string_view takeWord(std::string_view& rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
  const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
  rest.remove_prefix(word.size());
  return word;
}

std::string lowered(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

namespace {

// Optimal string alignment distance, row by row.
std::size_t editsBetween(const std::string& a, const std::string& b) {
  std::vector<std::size_t> beforeLast, last, row(b.size() + 1);
  for (std::size_t i = 0; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      if (i == 0) {
        row[j] = j;
        continue;
      }
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], beforeLast[j - 2] + 1);
    }
    beforeLast = std::exchange(last, row);
  }
  return last[b.size()];
}

struct NearName {
  std::string name;
  std::size_t edits = std::numeric_limits<std::size_t>::max();
};

NearName nearest(const std::string& name, const std::vector<std::string>& known) {
  const std::string wanted = lowered(name.substr(0, kLongestName));
  NearName best;
  for (const std::string& candidate : known)
    if (const std::size_t edits = editsBetween(wanted, lowered(candidate.substr(0, kLongestName))); edits < best.edits)
      best = {candidate, edits};
  return best;
}

// Names may be those of a file's columns: any, and many.
std::string listed(const std::vector<std::string>& known) {
  constexpr std::size_t kMost = 30;
  std::string out;
  for (std::size_t k = 0; k < std::min(known.size(), kMost); ++k) out += (k > 0 ? ", " : "") + shortened(known[k]);
  return out + (known.size() > kMost ? ", ..." : "");
}

}  // namespace

std::string nearestName(const std::string& name, const std::vector<std::string>& known) {
  return nearest(name, known).name;
}

std::string hintOfNames(const std::string& name, const std::vector<std::string>& known) {
  if (known.empty()) return {};
  const NearName best = nearest(name, known);
  const bool alike = 2 * best.edits <= std::min(std::max(name.size(), best.name.size()), kLongestName);
  return alike ? "did you mean " + inQuotes(best.name, '"') + "?" : "expected one of " + listed(known);
}

std::string hintAndNames(const std::string& name, const std::vector<std::string>& known) {
  const std::string hint = hintOfNames(name, known), all = listed(known);
  return hint.ends_with(all) ? hint : hint + " known: " + all;
}

}  // namespace medulla
