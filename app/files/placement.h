#pragma once

#include <Eigen/Geometry>
#include <string>

#include "app/files/xml_element.h"

// Attributes that scenes and recordings share: vectors, orientations and paths. Errors are those of refuse().
namespace medulla {

Eigen::Vector3d readVector(const XmlElement& element, const std::string& attribute, const Eigen::Vector3d& fallback,
                           Range range = kAnyNumber);

// A quaternion w x y z, within 1e-3 of unit length; identity where absent.
Eigen::Quaterniond readOrientation(const XmlElement& element, const std::string& attribute);

// From "position", in metres, and "orientation".
Eigen::Isometry3d readPlacement(const XmlElement& element);

// Relative to the folder of the file that names it.
std::string readPath(const XmlElement& element, const std::string& attribute, const std::string& namedIn);

}  // namespace medulla
