#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/dynamics/world.h"

// A body's masses, stiffnesses and dampings from its tissue and its model's geometry (physics/README.md). Model frame.
namespace medulla {

struct LinkStiffness {
  double elongation = 0;              // N/m
  double flexionU = 0, flexionV = 0;  // N m/rad about U, about V: moment at an end per flexion there
  double coupleU = 0, coupleV = 0;    // N m/rad: moment at an end per flexion at the other; 0 of springs
  double torsion = 0;                 // N m/rad
};

struct BodyMechanics {
  std::vector<double> sphereMass;              // kg, without what the nodes carry
  std::vector<Eigen::Matrix3d> sphereInertia;  // kg m2 about the frame, likewise
  std::vector<bool> moves, turns;              // per sphere: what is not fixed
  std::vector<LinkStiffness> links;
  std::vector<Attachment> attachments;      // of the model, with restOffset made exactly perpendicular to links
  std::vector<double> attachmentStiffness;  // N/m per node; of the full surface
  std::vector<double> edgeStiffness;        // N/m per edge; of the full surface
  std::vector<double> nodeMass;             // kg; 0 on skin
  std::vector<bool> nodeMoves;              // per node: not fixed
  // Set by dampBody. s, damping over stiffness, Rayleigh's beta of links and surface; 1/s, damping over mass, his
  // alpha.
  double linkRelaxation = 0, surfaceRelaxation = 0, massDamping = 0;
};

// Throws std::runtime_error, without the body's name, where the description cannot be simulated.
BodyMechanics bodyMechanics(const BodyDescription& body);

}  // namespace medulla
