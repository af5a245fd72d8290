#include "physics/dynamics/region.h"

namespace medulla {

bool contains(const Region& region, const Eigen::Vector3d& x) {
  switch (region.shape) {
    case Region::Shape::box:
      return region.box.contains(x);
    case Region::Shape::ball:
      return (x - region.centre).norm() <= region.radius;
    case Region::Shape::halfSpace:
      return region.normal.dot(x) <= region.distance;
  }
  return false;
}

std::vector<int> nodesInRegion(const SoftBodyModel& model, const Region& region) {
  std::vector<int> out;
  for (std::size_t i = 0; i < model.restNodes.size(); ++i)
    if (contains(region, model.restNodes[i])) out.push_back(static_cast<int>(i));
  return out;
}

}  // namespace medulla
