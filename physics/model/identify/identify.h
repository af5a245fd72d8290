#pragma once

#include <functional>
#include <string>
#include <vector>

#include "physics/model/identify/held_region.h"
#include "physics/model/identify/link_fit.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

struct IdentifySettings {
  double poisson = 0.45;  // 0 <= poisson < 0.5
  LinkForm links = LinkForm::full;
  double memoryMax = 3e9;  // bytes of the finite elements' factors
  double cellSize = 0;     // m; 0: chosen from the spheres' cells and the links' sections
};

// Finds the network of `model` by finite elements of its own mesh, solved once. `progress`, if given, is called with
// 0..1. Deterministic. Throws std::runtime_error on a region without a whole triangle, on settings out of range, and
// where finite elements of the size that the mesh needs would not fit.
IdentifiedNetwork identifyNetwork(const SoftBodyModel& model, const std::vector<HeldRegion>& held,
                                  const IdentifySettings& settings, const std::function<void(double)>& progress = {});

}  // namespace medulla
