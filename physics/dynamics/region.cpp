#include "physics/dynamics/region.h"

namespace medulla {

std::optional<Region> makeRegion(Region::Shape shape, const std::vector<double>& numbers) {
  const auto corner = [&](std::size_t first) {
    return Eigen::Vector3d(numbers[first], numbers[first + 1], numbers[first + 2]);
  };
  Region region;
  region.shape = shape;
  bool holds = false;
  switch (shape) {
    case Region::Shape::box:
      region.box = {corner(0), corner(3)};
      holds = !region.box.isEmpty();
      break;
    case Region::Shape::ball:
      region.centre = corner(0);
      region.radius = numbers[3];
      holds = region.radius > 0;
      break;
    case Region::Shape::halfSpace:
      region.normal = corner(0);
      region.distance = numbers[3];
      holds = !region.normal.isZero(0);
      break;
  }
  return holds ? std::optional(region) : std::nullopt;
}

bool Region::operator==(const Region& other) const {
  return shape == other.shape && box.min() == other.box.min() && box.max() == other.box.max() &&
         centre == other.centre && radius == other.radius && normal == other.normal && distance == other.distance;
}

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
