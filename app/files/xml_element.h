#pragma once

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "app/files/input_error.h"

// Strict reading of XML, shared by scene and model: a tree of plain values, a table of what may stand where, and
// attribute readers that complain with the place. Nothing of the XML library shows here.
namespace medulla {

struct XmlAttribute {
  std::string name, value;
  std::string where;  // what a complaint starts with: "FILE:LINE", or "--set PATH" for a value from the command line
};

struct XmlElement {
  std::string name;
  std::string where;  // "FILE:LINE"
  ElementPlace place;
  std::vector<XmlAttribute> attributes;
  std::vector<XmlElement> children;
  std::string text;  // from its first character that is not white space
  int textLine = 0;
  std::string textWhere;

  const XmlAttribute* find(const std::string& attribute) const;  // nullptr where absent
};

// What may stand in an element. Elements are known by name alone: the same name means the same thing everywhere.
struct XmlRule {
  struct Child {
    std::string name;
    int least = 0, most = std::numeric_limits<int>::max();
    bool addable = most == 1;  // --set may add one that the file leaves out, where no attribute of it is required
  };
  std::string element;
  std::vector<std::string> required, optional;  // attributes
  std::vector<Child> children;
  bool text = false;  // holds text of its own
};
using XmlRules = std::vector<XmlRule>;  // the first is the root's; every child named in it has its own

// Reads a file and holds it against the rules. Throws std::runtime_error "FILE:LINE: ..." on broken XML, another root,
// unknown (naming the nearest known one), repeated, missing or stray attributes, elements and text. `edit`, if given,
// may change the tree before it is held against the rules.
XmlElement readXml(const std::string& path, const XmlRules& rules, const std::function<void(XmlElement&)>& edit = {});

std::vector<const XmlElement*> childrenOf(const XmlElement& parent, const std::string& name);
// An absent element reads like an empty one: every attribute at its default.
const XmlElement& onlyChild(const XmlElement& parent, const std::string& name);

// False of tables and other text; not yet refused are empty files and broken XML.
bool beginsAsXml(const std::string& text);

// Name of the root element. Throws std::runtime_error "FILE:LINE: ..." on broken XML.
std::string rootElementOf(const std::string& path);

const XmlRule& ruleOf(const XmlRules& rules, const std::string& element);  // asserts that there is one

// An interval that a value must lie in.
struct Range {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool lowExcluded = false, highExcluded = false;
  double most = 1e30;     // either way: products of larger numbers overflow
  double least = 1e-100;  // of what has to be more than 0: squares of smaller numbers vanish
};
inline constexpr Range kAnyNumber{};
inline constexpr Range kPositive{0, std::numeric_limits<double>::infinity(), true, false};
inline constexpr Range kNotNegative{0};
// In newtons and m/s2: beyond what any step follows.
inline constexpr Range kAnyForce{.most = 1e6};
// In metres, of what is drawn and felt: both is done in single precision.
inline constexpr Range kAnyPlace{.most = 1000};
inline constexpr Range kAnyLength{.low = 0, .lowExcluded = true, .most = kAnyPlace.most};

// Complaint about one attribute: "WHERE: <element> name="value": message".
[[noreturn]] void refuse(const XmlElement& element, const std::string& attribute, const std::string& message);

// Attribute readers: `fallback` where the attribute is absent. Numbers are finite and within `range`; lists are
// separated by white space. All throw std::runtime_error through refuse().
double readNumber(const XmlElement& element, const std::string& attribute, double fallback, Range range = kAnyNumber);
int readInteger(const XmlElement& element, const std::string& attribute, int fallback, Range range = kAnyNumber);
// `count` numbers, or one and more for a count of 0; empty where the attribute is absent.
std::vector<double> readNumbers(const XmlElement& element, const std::string& attribute, int count,
                                Range range = kAnyNumber);
std::vector<int> readIntegers(const XmlElement& element, const std::string& attribute, int count,
                              Range range = kAnyNumber);
std::string readText(const XmlElement& element, const std::string& attribute, const std::string& fallback = "");
// Separated by white space; none where the attribute is absent.
std::vector<std::string> readWords(const XmlElement& element, const std::string& attribute);
// Index into `known`, of which the nearest is named otherwise.
int readChoice(const XmlElement& element, const std::string& attribute, const std::vector<std::string>& known,
               int fallback);

}  // namespace medulla
