#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/dynamics/world.h"

// What is held or driven leaves a body some rigid motions. Deformation is motion beyond these: they cost no elastic
// energy, and damping must not slow them, be it a pendulum on its pin or a body that is carried along.
namespace medulla {

enum class RigidFreedom { all, aboutPoint, aboutLine, none };

struct SupportPoint {  // the one or the other, numbers of the body's own
  int sphere = -1, node = -1;
};

struct RigidSupport {
  RigidFreedom freedom = RigidFreedom::all;
  SupportPoint point;   // but for `all`: its motion leads; fixed ones before driven ones
  SupportPoint second;  // of `aboutLine`, the line's other end
};

RigidSupport rigidSupport(const BodyDescription& body);

// m, model frame: where nodes are held. A skin of beams or springs holds none by itself.
std::vector<Eigen::Vector3d> heldNodes(const BodyDescription& body);

// Whether the body's own nodes, where fixed, hold it.
inline bool holdsByNodes(const BodyDescription& body) {
  const bool knowsNodes = body.surface != SurfaceMode::skin || body.links == LinkModel::identified;
  return knowsNodes && !body.fixedNodes.empty();
}

inline bool isHeld(const BodyDescription& body) {
  return !body.fixed.empty() || holdsByNodes(body);
}

}  // namespace medulla
