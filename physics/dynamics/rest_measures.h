#pragma once

#include <vector>

#include "physics/dynamics/body_mechanics.h"

namespace medulla {

// Freedoms: 6 per sphere (velocity, angular velocity), then 3 per node. One link measure's rate at rest:
// line . (v1 - v0) + turn0 . w0 + turn1 . w1.
struct MeasureRow {
  int sphere0, sphere1;  // the second -1: held
  Eigen::Vector3d line, turn0, turn1;
  double stiffness;
};

// Of all links of the body at rest: their stiffness is the sum of the rows' squares.
std::vector<MeasureRow> measureRows(const SoftBodyModel& model, const BodyMechanics& mechanics);

// The rates at rest of one identified cell's strain, (N/m)^1/2: its own sphere and all that it is linked to.
struct StrainRow {
  std::vector<int> spheres;     // each once
  std::vector<Vector6d> rates;  // per sphere, of (velocity, angular velocity)
};

// Of all cells that have one; their stiffness is the sum of the rows' squares. Empty of bodies without.
std::vector<StrainRow> strainRows(const SoftBodyModel& model, const BodyMechanics& mechanics);

}  // namespace medulla
