#pragma once

#include <memory>
#include <vector>

#include "tests/synthetic_model.h"

// Hand-made identified networks: links with the stiffness of beams, nodes that blend the frames near them. They stand
// in for what finite elements find, where a test wants closed forms or holds for any network.
namespace medulla::synthetic {

struct NetworkSettings {
  std::vector<int> held;   // nodes, of one patch; none: no patch
  double uneven = 0;       // 0: beams and plain blends; more: every number of stiffness and map is shaken by this share
  std::size_t frames = 6;  // of each node at most
  double surface = 100;    // 1/m of the layer's springs
};

// The cells' frames lie off the spheres' by `arm`.
std::shared_ptr<SoftBodyModel> withNetwork(const SoftBodyModel& model, const NetworkSettings& settings = {},
                                           const Vector3d& arm = Vector3d::Zero(), double poisson = 0.45);

BodyDescription identifiedBody(std::shared_ptr<const SoftBodyModel> model, double young);

}  // namespace medulla::synthetic
