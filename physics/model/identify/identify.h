#pragma once

#include <functional>
#include <vector>

#include "physics/model/identify/held_region.h"
#include "physics/model/identify/link_fit.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// Each evaluation of the links' fit inverts a dense matrix of order 6 spheres: some four hundred times over at the most
// spheres, a thousand times with few, twice as often where links have strains.
constexpr int kIdentifiedSpheresMax = 300;

struct IdentifySettings {
  double poisson = 0.45;  // 0 <= poisson < 0.5
  LinkForm links = LinkForm::full;
  double memoryMax = 3e9;  // bytes of the factors of each grid of finite elements
};

struct Identification {
  IdentifiedNetwork network;
  // Bulk loads that nothing was fitted to, none on what is held, and what finite elements make of them at 1 Pa: 3 nodes
  // x loads, N and m.
  Eigen::MatrixXd forces, displacements;
};

// Finds the network of `model` by finite elements of its own mesh, solved once, on several threads.
// `progress` is called from the calling thread with 0..1; where it throws, the others end too.
// Deterministic: sets Eigen's cache sizes (for the whole program) so that sums run in one order on any processor; bytes
// may still differ between mathematical libraries. Throws std::runtime_error on a region without a whole triangle, on
// settings out of range, on more than kIdentifiedSpheresMax spheres, on a single sphere that nothing holds, on a
// surface with fewer than three free nodes, where finite elements of the size that the mesh needs would not fit, where
// the mesh is too thin for those that do, and where a number of the result would not be finite.
Identification identifyNetwork(
    const SoftBodyModel& model, const std::vector<HeldRegion>& held, const IdentifySettings& settings,
    const std::function<void(double)>& progress = [](double) {});

}  // namespace medulla
