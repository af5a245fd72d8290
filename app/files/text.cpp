#include "app/files/text.h"

#include <algorithm>
#include <limits>

namespace medulla {

std::string inQuotes(std::string_view word, char mark) {
  constexpr std::size_t kLongest = 60;
  std::string out(1, mark);
  for (const char c : word.substr(0, kLongest)) {
    const bool blank = c == '\n' || c == '\t' || c == '\r', control = static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    out += blank ? ' ' : control ? '?' : c;
  }
  if (word.size() > kLongest) out += "...";
  return out + mark;
}

std::string shellWord(std::string_view word) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/._-+,=@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) return std::string(word);
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
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

namespace {

std::string lowered(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

// Optimal string alignment distance, row by row.
std::size_t editsBetween(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

constexpr std::size_t kLongestName = 200;  // nobody mistypes more; the table of edits is quadratic

struct NearName {
  std::string name;
  std::size_t edits = std::numeric_limits<std::size_t>::max();
};

NearName nearest(const std::string& name, const std::vector<std::string>& known) {
  const std::string wanted = lowered(name.substr(0, kLongestName));
  NearName best;
  for (const std::string& candidate : known)
    if (const std::size_t edits = editsBetween(wanted, lowered(candidate)); edits < best.edits)
      best = {candidate, edits};
  return best;
}

}  // namespace

std::string nearestName(const std::string& name, const std::vector<std::string>& known) {
  return nearest(name, known).name;
}

std::string hintOfNames(const std::string& name, const std::vector<std::string>& known) {
  if (known.empty()) return {};
  const NearName best = nearest(name, known);
  const bool alike = 2 * best.edits <= std::max(std::min(name.size(), kLongestName), best.name.size());
  return alike ? "did you mean " + inQuotes(best.name, '"') + "?" : "expected one of " + joined(known, ", ");
}

}  // namespace medulla
