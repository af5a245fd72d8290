#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "physics/model/soft_body_model.h"

namespace medulla {

// A part of space in the model frame, m: inside a box, inside a ball, or on one side of a plane.
struct Region {
  enum class Shape { box, ball, halfSpace } shape = Shape::box;
  Eigen::AlignedBox3d box;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius = 0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  // of any length but 0: points x with normal . x <= distance
  double distance = 0;
  bool operator==(const Region& other) const;
};

// How a region is written down: its word, the numbers that follow, and what they must be.
struct RegionForm {
  Region::Shape shape;
  const char* word;
  std::size_t count;
  const char* numbers;
  const char* rule;
};
inline constexpr std::array kRegionForms = {
    RegionForm{Region::Shape::box, "box", 6, "x0 y0 z0 x1 y1 z1", "the lower corner first"},
    RegionForm{Region::Shape::ball, "sphere", 4, "x y z r", "a radius > 0"},
    RegionForm{Region::Shape::halfSpace, "plane", 4, "nx ny nz d", "a direction and a distance"}};

// Of as many numbers as the form has; nothing where they break its rule.
std::optional<Region> makeRegion(Region::Shape shape, const std::vector<double>& numbers);

bool contains(const Region& region, const Eigen::Vector3d& x);

// Surface nodes that lie in the region at rest, ascending.
std::vector<int> nodesInRegion(const SoftBodyModel& model, const Region& region);

}  // namespace medulla
