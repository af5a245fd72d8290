#pragma once

#include "physics/model/build.h"
#include "physics/model/medial_balls.h"

namespace medulla {

// Distance from p to the surface of a link cone, the hull of two balls; negative inside. m.
double signedDistanceToCone(const Eigen::Vector3d& p, const Ball& a, const Ball& b);

// Everything of a report but the build's seconds, hollow links and long edges, from the model alone.
BuildReport measureModel(const SoftBodyModel& model);

}  // namespace medulla
