#pragma once

#include <memory>
#include <vector>

#include "physics/dynamics/world.h"

// Hand-made models whose answers are known: tubes around chains of spheres, and a slab of spheres in a tube. They stand
// in for built models where a test or a benchmark wants closed forms or a fixed size.
namespace medulla::synthetic {

using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Tube {
  std::vector<Vector3d> centre;  // m, spheres in a row
  std::vector<double> radius;    // m, of the swept mesh at each
  int rings = 13, segments = 18;
};

Tube straightTube(int spheres, double length, double radius, int rings, int segments);

void addLink(SoftBodyModel& m, int a, int b, double radius, double share = 1);

// A chain in a tube. Every sphere's cell is a straight cylinder along the local centre line; the end cells reach half a
// link beyond their sphere, so that all cells of an even chain are alike.
std::shared_ptr<SoftBodyModel> chainModel(const Tube& tube, double surfaceShare = 0.2, bool closeFirstTriple = false);

// Of spheres 20 mm apart, 20 mm across and six nodes around, with uneven sections and arms at its ends: no symmetry
// hides a wrong axis.
std::shared_ptr<SoftBodyModel> unevenChain(int spheres, int rings);

// Of 5 spheres and 82 nodes: 8 cm long, 24 mm across.
std::shared_ptr<SoftBodyModel> shortTube();

BodyDescription body(std::shared_ptr<const SoftBodyModel> model, double young, std::vector<FixedSphere> fixed = {});

// (a) of the speed comparison: 7 spheres, 7 links, 236 nodes, 702 springs.
std::vector<BodyDescription> gallbladderScene();

// (b): 411 spheres, 505 links, 5288 nodes, 15 834 springs.
std::vector<BodyDescription> abdomenScene();

}  // namespace medulla::synthetic
