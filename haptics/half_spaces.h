#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

// What a sphere's centre may reach: beyond each touched plane, the point nearest to where it is drawn (Zilles and
// Salisbury 1995).
namespace medulla {

struct HalfSpace {
  Eigen::Vector3d normal;  // unit; allowed are points x with normal.x >= offset
  double offset = 0;
};

// The point nearest to `goal` in up to three half-spaces, by enumeration of which of them are active. `pressure[k]` is
// the Kuhn-Tucker multiplier: result = goal + sum pressure[k] normal[k], all >= 0. Returns false, with result
// untouched, when no point satisfies all (within rounding, a millionth of the way there), as between opposite walls.
bool nearestInHalfSpaces(const Eigen::Vector3d& goal, std::span<const HalfSpace> halfSpaces, Eigen::Vector3d& result,
                         std::array<double, 3>& pressure);

}  // namespace medulla
