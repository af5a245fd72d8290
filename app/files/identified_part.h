#pragma once

#include <memory>
#include <string>

#include "app/files/xml_element.h"
#include "physics/model/soft_body_model.h"

// The optional part of a model file that `medulla build --identify` adds. Columns of its arrays are those of the
// structs in physics/model/identified_network.h, in their order, less what follows from the rest: restPoint0, rest
// points of skin frames that are spheres, and the upper triangle of a stiffness.
namespace medulla {

XmlRules identifiedRules();
void putIdentified(std::string& out, const IdentifiedNetwork& network);
// Throws std::runtime_error "FILE:LINE: ..." on what does not fit together or to the model's spheres and nodes.
std::shared_ptr<const IdentifiedNetwork> readIdentified(const std::string& path, const XmlElement& element,
                                                        const SoftBodyModel& model);

}  // namespace medulla
