#include "app/files/placement.h"

#include <cmath>
#include <filesystem>

#include "app/files/output_file.h"

namespace medulla {

Eigen::Vector3d readVector(const XmlElement& element, const std::string& attribute, const Eigen::Vector3d& fallback,
                           Range range) {
  const std::vector<double> v = readNumbers(element, attribute, 3, range);
  return v.empty() ? fallback : Eigen::Vector3d(v[0], v[1], v[2]);
}

Eigen::Quaterniond readOrientation(const XmlElement& element, const std::string& attribute) {
  const std::vector<double> q = readNumbers(element, attribute, 4);
  if (q.empty()) return Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond orientation(q[0], q[1], q[2], q[3]);
  // Rounded figures are normalised; anything further off is a mistake rather than rounding.
  if (!(std::abs(orientation.norm() - 1) <= 1e-3))
    refuse(element, attribute, "expected a unit quaternion w x y z (length within 1e-3 of 1)");
  return orientation.normalized();
}

Eigen::Isometry3d readPlacement(const XmlElement& element) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  if (element.find("orientation")) out.linear() = readOrientation(element, "orientation").toRotationMatrix();
  out.translation() = readVector(element, "position", Eigen::Vector3d::Zero(), kAnyPlace);
  return out;
}

std::string readPath(const XmlElement& element, const std::string& attribute, const std::string& namedIn) {
  const std::filesystem::path folder = std::filesystem::path(namedIn).parent_path();
  return normalised(folder / readText(element, attribute)).string();
}

}  // namespace medulla
