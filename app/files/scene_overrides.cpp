#include "app/files/scene_overrides.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "app/files/scene_rules.h"
#include "app/files/text.h"

namespace medulla {

namespace {

// Attributes that an override can reach, with their paths: every one that the rules know, present or not.
struct Target {
  std::string path;
  XmlElement* element;
  std::string attribute;
};

void listTargets(XmlElement& element, const std::string& prefix, std::vector<Target>& out) {
  const XmlRule& rule = ruleOf(sceneRules(), element.name);
  for (const auto* attributes : {&rule.required, &rule.optional})
    for (const std::string& a : *attributes) out.push_back({prefix + a, &element, a});
  for (XmlElement& child : element.children) {
    const bool known = std::any_of(rule.children.begin(), rule.children.end(),
                                   [&](const XmlRule::Child& c) { return c.name == child.name; });
    if (!known) continue;  // refused later, at its own line
    const XmlAttribute* name = child.find("name");
    listTargets(child, prefix + child.name + "." + (name ? name->value + "." : ""), out);
  }
}

// So that light.intensity can be overridden where the scene leaves <light> to its defaults. An element that cannot be
// empty has none.
void addOptionalElements(XmlElement& element) {
  const XmlRule& rule = ruleOf(sceneRules(), element.name);
  for (const XmlRule::Child& child : rule.children) {
    const bool present = std::any_of(element.children.begin(), element.children.end(),
                                     [&](const XmlElement& e) { return e.name == child.name; });
    if (present || child.least > 0 || !child.addable || !ruleOf(sceneRules(), child.name).required.empty()) continue;
    XmlElement added;
    added.name = child.name;
    added.where = element.where;
    added.place = element.place;
    element.children.push_back(added);
  }
  for (XmlElement& child : element.children)
    if (child.name == "body") addOptionalElements(child);
}

// A wrong name of a body or tool is the likeliest mistake: of paths with the same kind of element and attribute, if
// any.
std::string nearestPath(const std::string& path, const std::vector<Target>& targets) {
  const auto ends = [](const std::string& of) {
    return std::pair(of.substr(0, of.find('.')), of.substr(of.find_last_of('.') + 1));
  };
  std::vector<std::string> known, alike;
  for (const Target& t : targets) {
    known.push_back(t.path);
    if (ends(t.path) == ends(path)) alike.push_back(t.path);
  }
  return nearestName(path, alike.empty() ? known : alike);
}

// Of a path that stops at an element: the first value behind it, its name apart. Empty where there is none.
std::string valueBehind(const std::string& path, const std::vector<Target>& targets) {
  for (const Target& t : targets)
    if (t.attribute != "name" && t.path.starts_with(path + ".")) return t.path;
  return {};
}

OverriddenAttribute applyOverride(XmlElement& root, const SceneOverride& override) {
  const std::string where = "--set " + override.path;
  std::vector<Target> targets;
  listTargets(root, "", targets);
  targets.push_back({"scene.name", &root, "name"});
  const auto matches = [&](const Target& t) { return t.path == override.path; };
  const auto found = std::find_if(targets.begin(), targets.end(), matches);
  if (found == targets.end()) {
    if (const std::string value = valueBehind(override.path, targets); !value.empty())
      throw std::runtime_error(where + ": expected a value of it, such as " + value);
    const std::string nearest = nearestPath(override.path, targets), nothing = ": the scene has nothing of this name";
    const auto isNearest = [&nearest](const Target& t) { return t.path == nearest; };
    if (std::count_if(targets.begin(), targets.end(), isNearest) > 1)
      throw std::runtime_error(where + nothing + ", and several elements answer to " + nearest +
                               ", which reaches none");
    throw std::runtime_error(where + nothing + "; did you mean " + nearest + "?");
  }
  if (std::count_if(targets.begin(), targets.end(), matches) > 1)
    throw std::runtime_error(where + ": several elements answer to this, expected one");
  XmlElement& element = *found->element;
  std::erase_if(element.attributes, [&](const XmlAttribute& a) { return a.name == found->attribute; });
  element.attributes.push_back({found->attribute, override.value, where});
  return {element.place, found->attribute, override.path};
}

}  // namespace

std::vector<OverriddenAttribute> applyOverrides(XmlElement& root, const std::vector<SceneOverride>& overrides) {
  if (!overrides.empty()) addOptionalElements(root);
  std::vector<OverriddenAttribute> out;
  out.reserve(overrides.size());
  for (const SceneOverride& override : overrides) out.push_back(applyOverride(root, override));
  return out;
}

}  // namespace medulla
