#pragma once

#include "app/files/xml_element.h"

namespace medulla {

// Every element and attribute of a scene file; scenes/scene.xsd says the same to editors.
const XmlRules& sceneRules();

}  // namespace medulla
