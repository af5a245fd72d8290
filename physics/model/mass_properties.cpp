#include "physics/model/mass_properties.h"

#include <Eigen/Geometry>

namespace medulla {

MassProperties massProperties(const TriangleMesh& mesh) {
  MassProperties m;
  // Relative to a vertex: far from the origin the tetrahedra would cancel.
  const Eigen::Vector3d origin = mesh.vertices.empty() ? Eigen::Vector3d::Zero().eval() : mesh.vertices[0];
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  for (const std::array<int, 3>& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
                          c = mesh.vertices[t[2]] - origin, sum = a + b + c;
    const double volume = a.dot(b.cross(c)) / 6;
    m.volume += volume;
    first += volume / 4 * sum;
    m.secondMoment += volume / 20 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  const Eigen::Vector3d centroid = first / m.volume;
  m.secondMoment -= m.volume * centroid * centroid.transpose();
  m.centroid = origin + centroid;
  return m;
}

MassProperties combined(const std::vector<MassProperties>& parts) {
  MassProperties total;
  for (const MassProperties& part : parts) {
    total.volume += part.volume;
    total.centroid += part.volume * part.centroid;
  }
  total.centroid /= total.volume;
  for (const MassProperties& part : parts) {
    const Eigen::Vector3d r = part.centroid - total.centroid;
    total.secondMoment += part.secondMoment + part.volume * r * r.transpose();
  }
  return total;
}

}  // namespace medulla
