#include "app/files/xml_element.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "app/files/input_error.h"
#include "app/files/number_text.h"
#include "app/files/text.h"
#include "app/files/text_file.h"

namespace medulla {

bool beginsAsXml(const std::string& text) {
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  return start == std::string::npos || text[start] == '<';
}

namespace {

std::string place(const std::string& path, int line) {
  return path + ":" + std::to_string(line);
}

std::runtime_error complaint(const std::string& where, const std::string& message) {
  return std::runtime_error(where + ": " + message);
}

const char* describe(tinyxml2::XMLError error) {
  switch (error) {
    case tinyxml2::XML_ERROR_MISMATCHED_ELEMENT:
      return "an element is not closed where it was opened";
    case tinyxml2::XML_ERROR_PARSING_ATTRIBUTE:
      return "an attribute is not of the form name=\"value\", or stands twice";
    case tinyxml2::XML_ERROR_PARSING_ELEMENT:
      return "a tag is not complete";
    case tinyxml2::XML_ERROR_PARSING_TEXT:
      return "text that no tag ends";
    case tinyxml2::XML_ERROR_PARSING_COMMENT:
      return "a comment without its end -->";
    case tinyxml2::XML_ERROR_PARSING_CDATA:
      return "a CDATA section without its end ]]>";
    case tinyxml2::XML_ERROR_PARSING_DECLARATION:
      return "a declaration that is misplaced or without its end ?>";
    case tinyxml2::XML_ERROR_EMPTY_DOCUMENT:
      return "the file is empty";
    case tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED:
      return "elements are nested too deeply";
    case tinyxml2::XML_ERROR_PARSING:
      return "an element that nothing closes";
    default:
      return tinyxml2::XMLDocument::ErrorIDToName(error);
  }
}

void copyText(const std::string& path, const tinyxml2::XMLText& text, XmlElement& out) {
  const std::string_view value = trimmed(text.Value());
  if (value.empty()) return;
  // Lines of the text are counted from its start, which only holds for one piece.
  if (!out.text.empty())
    throw inputError(path, text.GetLineNum(), "<" + out.name + ">: text in several pieces, expected one");
  out.text = value;
  out.textLine = text.GetLineNum();
  out.textWhere = place(path, out.textLine);
}

// `count`: elements of the file so far.
XmlElement copyElement(const std::string& path, const tinyxml2::XMLElement& element, int& count) {
  XmlElement out;
  out.name = element.Name();
  out.place = {element.GetLineNum(), count++};
  out.where = place(path, out.place.line);
  for (const tinyxml2::XMLAttribute* a = element.FirstAttribute(); a; a = a->Next()) {
    out.attributes.push_back({a->Name(), a->Value(), place(path, a->GetLineNum())});
    // As XML has it (3.3.3), if not of &#10;, which the XML library does not tell apart: a value that goes on in the
    // next line has a blank there.
    for (char& c : out.attributes.back().value)
      if (c == '\n' || c == '\t' || c == '\r') c = ' ';
  }
  for (const tinyxml2::XMLNode* n = element.FirstChild(); n; n = n->NextSibling()) {
    if (const tinyxml2::XMLElement* child = n->ToElement()) out.children.push_back(copyElement(path, *child, count));
    if (const tinyxml2::XMLText* text = n->ToText()) copyText(path, *text, out);
    if (n->ToUnknown()) throw inputError(path, n->GetLineNum(), "<!...> inside an element is not understood");
  }
  return out;
}

// What editors save as Latin-1 declares itself so, or says nothing.
void requireUtf8(const std::string& path, const std::string& text) {
  std::size_t more = 0;  // bytes that the letter still has
  unsigned char first = 0;
  int line = 1;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool goesOn = (byte & 0xC0U) == 0x80;
    const std::size_t rest = byte < 0x80 ? 0 : byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : 1;
    if (goesOn != (more > 0) || byte >= 0xF8)
      throw inputError(path, line,
                       fmt::format("holds the byte 0x{:X}, expected UTF-8 or ASCII", more > 0 ? first : byte));
    if (!goesOn) first = byte;
    more = goesOn ? more - 1 : rest;
    line += c == '\n';
  }
  if (more > 0) throw inputError(path, line, "ends within a letter, expected UTF-8 or ASCII");
}

// The XML library takes a DOCTYPE to its first '>', which is the end of its first declaration where it has some.
bool hasDeclarations(const tinyxml2::XMLDocument& document) {
  const tinyxml2::XMLUnknown* first = nullptr;
  for (const tinyxml2::XMLNode* n = document.FirstChild(); n && !first; n = n->NextSibling()) first = n->ToUnknown();
  const std::string_view value = first ? first->Value() : "";
  return value.starts_with("DOCTYPE") && value.find('[') != std::string_view::npos;
}

XmlElement parseXml(const std::string& path) {
  const std::string text = readTextFile(path);
  // The XML library would take a zero byte for the end of the file.
  if (text.find('\0') != std::string::npos) throw inputError(path, 0, "holds a zero byte, expected XML text");
  requireUtf8(path, text);
  if (!beginsAsXml(text)) throw inputError(path, 0, "is no XML: expected a file that begins with <");
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw inputError(path, document.ErrorLineNum(), std::string("broken XML: ") + describe(document.ErrorID()));
  const tinyxml2::XMLElement* root = document.RootElement();
  if (!root) throw inputError(path, 0, "broken XML: no element");
  for (const tinyxml2::XMLNode* n = document.FirstChild(); n; n = n->NextSibling())
    if (n != root && (n->ToElement() || n->ToText()))
      throw inputError(path, n->GetLineNum(),
                       hasDeclarations(document) ? "declarations within a DOCTYPE are not understood, expected none"
                                                 : "broken XML: more than one element or text at the top");
  int count = 0;
  return copyElement(path, *root, count);
}

std::string suggestion(const std::string& name, const std::vector<std::string>& known) {
  const std::string hint = hintOfNames(name, known);
  return "; " + (hint.empty() ? "it has none" : hint);
}

void checkAttributes(const XmlElement& element, const XmlRule& rule) {
  std::vector<std::string> known = rule.required;
  known.insert(known.end(), rule.optional.begin(), rule.optional.end());
  for (const XmlAttribute& a : element.attributes) {
    if (isOneOf(a.name, known)) continue;
    if (a.name.starts_with("xmlns:") || a.name.starts_with("xsi:")) continue;  // by which editors find the schema
    throw complaint(a.where,
                    "<" + element.name + "> has no attribute " + inQuotes(a.name, '"') + suggestion(a.name, known));
  }
  for (const std::string& name : rule.required)
    if (!element.find(name))
      throw complaint(element.where, "<" + element.name + "> lacks the attribute " + inQuotes(name, '"'));
}

void checkElement(const XmlElement& element, const XmlRules& rules) {
  const XmlRule& rule = ruleOf(rules, element.name);
  checkAttributes(element, rule);
  if (!rule.text && !element.text.empty()) {
    throw complaint(element.textWhere,
                    "<" + element.name + "> holds text " + inQuotes(element.text, '"') + ", expected none");
  }
  std::vector<std::string> known;
  for (const XmlRule::Child& child : rule.children) known.push_back(child.name);
  std::vector<int> count(known.size(), 0);
  for (const XmlElement& child : element.children) {
    const std::size_t k = std::find(known.begin(), known.end(), child.name) - known.begin();
    if (k == known.size()) {
      throw complaint(child.where,
                      "<" + element.name + "> has no child <" + child.name + ">" + suggestion(child.name, known));
    }
    if (++count[k] > rule.children[k].most) {
      throw complaint(child.where, "<" + element.name + "> has more than " + std::to_string(rule.children[k].most) +
                                       " <" + child.name + ">");
    }
    checkElement(child, rules);
  }
  for (std::size_t k = 0; k < known.size(); ++k)
    if (count[k] < rule.children[k].least)
      throw complaint(element.where, "<" + element.name + "> lacks a <" + known[k] + ">");
}

std::string describe(Range range) {
  const bool below = std::isfinite(range.low), above = std::isfinite(range.high);
  std::string low, high;
  if (below) appendNumber(low, range.low);
  if (above) appendNumber(high, range.high);
  const std::string lower = (range.lowExcluded ? "> " : ">= ") + low,
                    upper = (range.highExcluded ? "< " : "<= ") + high;
  if (below && above) return " " + lower + " and " + upper;
  if (below) return " " + lower;
  if (above) return " " + upper;
  return "";
}

bool contains(Range range, double value) {
  const bool low = range.lowExcluded ? value > range.low : value >= range.low;
  const bool high = range.highExcluded ? value < range.high : value <= range.high;
  return low && high;
}

std::vector<std::string> words(std::string_view text) {
  std::vector<std::string> out;
  for (std::string_view word = takeWord(text); !word.empty(); word = takeWord(text)) out.emplace_back(word);
  return out;
}

template <typename T>
std::vector<T> readList(const XmlElement& element, const std::string& attribute, int count, Range range) {
  const XmlAttribute* a = element.find(attribute);
  if (!a) return {};
  const std::vector<std::string> texts = words(a->value);
  const std::string kind = std::is_integral_v<T> ? "integer" : "number";
  const std::string expected =
      "expected " + (count == 0 ? "one or more" : std::to_string(count)) + " " + kind + (count == 1 ? "" : "s") +
      describe(range) + (count != 1 && a->value.find_first_of(",;") < a->value.size() ? ", separated by blanks" : "");
  if (count == 0 ? texts.empty() : texts.size() != static_cast<std::size_t>(count))
    refuse(element, attribute, expected);
  std::vector<T> values;
  for (const std::string& text : texts) {
    const std::optional<T> value = parseNumber<T>(text);
    if (!value || !contains(range, *value)) refuse(element, attribute, expected);
    const double number = static_cast<double>(*value);
    if (std::abs(number) > range.most)
      refuse(element, attribute, fmt::format("expected no number beyond {:g}", range.most));
    if (range.low == 0 && range.lowExcluded && number < range.least)
      refuse(element, attribute, fmt::format("expected no number below {:g}", range.least));
    values.push_back(*value);
  }
  return values;
}

}  // namespace

const XmlAttribute* XmlElement::find(const std::string& attribute) const {
  for (const XmlAttribute& a : attributes)
    if (a.name == attribute) return &a;
  return nullptr;
}

std::vector<const XmlElement*> childrenOf(const XmlElement& parent, const std::string& name) {
  std::vector<const XmlElement*> out;
  for (const XmlElement& child : parent.children)
    if (child.name == name) out.push_back(&child);
  return out;
}

const XmlElement& onlyChild(const XmlElement& parent, const std::string& name) {
  static const XmlElement absent;
  const std::vector<const XmlElement*> found = childrenOf(parent, name);
  return found.empty() ? absent : *found[0];
}

std::string rootElementOf(const std::string& path) {
  return parseXml(path).name;
}

XmlElement readXml(const std::string& path, const XmlRules& rules, const std::function<void(XmlElement&)>& edit) {
  XmlElement root = parseXml(path);
  const std::string& expected = rules.front().element;
  if (root.name != expected)
    throw complaint(root.where, "the root element is <" + root.name + ">, expected <" + expected + ">");
  if (edit) edit(root);
  checkElement(root, rules);
  return root;
}

const XmlRule& ruleOf(const XmlRules& rules, const std::string& element) {
  const auto rule = std::find_if(rules.begin(), rules.end(), [&](const XmlRule& r) { return r.element == element; });
  assert(rule != rules.end());
  return *rule;
}

void refuse(const XmlElement& element, const std::string& attribute, const std::string& message) {
  const XmlAttribute* a = element.find(attribute);
  if (!a) throw complaint(element.where, "<" + element.name + ">: " + message);
  throw complaint(a->where, "<" + element.name + "> " + attribute + "=" + inQuotes(a->value, '"') + ": " + message);
}

double readNumber(const XmlElement& element, const std::string& attribute, double fallback, Range range) {
  const std::vector<double> values = readNumbers(element, attribute, 1, range);
  return values.empty() ? fallback : values[0];
}

int readInteger(const XmlElement& element, const std::string& attribute, int fallback, Range range) {
  const std::vector<int> values = readIntegers(element, attribute, 1, range);
  return values.empty() ? fallback : values[0];
}

std::vector<double> readNumbers(const XmlElement& element, const std::string& attribute, int count, Range range) {
  return readList<double>(element, attribute, count, range);
}

std::vector<int> readIntegers(const XmlElement& element, const std::string& attribute, int count, Range range) {
  return readList<int>(element, attribute, count, range);
}

std::string readText(const XmlElement& element, const std::string& attribute, const std::string& fallback) {
  const XmlAttribute* a = element.find(attribute);
  if (!a) return fallback;
  if (a->value.empty()) refuse(element, attribute, "is empty");
  return a->value;
}

std::vector<std::string> readWords(const XmlElement& element, const std::string& attribute) {
  return words(readText(element, attribute));
}

int readChoice(const XmlElement& element, const std::string& attribute, const std::vector<std::string>& known,
               int fallback) {
  const XmlAttribute* a = element.find(attribute);
  if (!a) return fallback;
  const auto found = std::find(known.begin(), known.end(), a->value);
  if (found != known.end()) return static_cast<int>(found - known.begin());
  refuse(element, attribute, hintAndNames(a->value, known));
}

}  // namespace medulla
