#pragma once

#include <vector>

#include "app/files/xml_element.h"
#include "app/scene.h"

namespace medulla {

// Replaces attributes in the tree of a scene file before it is held against the rules. Throws std::runtime_error
// "--set PATH: ..." where nothing, or more than one element, answers to the path. Returns what they replaced.
std::vector<OverriddenAttribute> applyOverrides(XmlElement& root, const std::vector<SceneOverride>& overrides);

}  // namespace medulla
