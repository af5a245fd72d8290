#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "physics/dynamics/link_mechanics.h"
#include "physics/dynamics/world.h"

// A body's masses, stiffnesses and dampings from its tissue and its model's geometry (physics/equations). Model frame.
namespace medulla {

// Throws std::runtime_error with this message, to which whoever knows the body adds its name.
void require(bool condition, const std::string& message);

struct LinkStrains {  // what an identified link's measures add to the strains of the cells of its two frames
  Vector6d at0, at1;
};

struct BodyMechanics {
  std::vector<double> sphereMass;              // kg, without what the nodes carry
  std::vector<Eigen::Matrix3d> sphereInertia;  // kg m2 about the frame, likewise
  std::vector<bool> moves, turns;              // per sphere: what is not fixed
  std::vector<LinkSpan> spans;                 // per link
  std::vector<LinkStiffness> links;
  std::vector<Attachment> attachments;      // to the spans of links, with restOffset made exactly perpendicular to them
  std::vector<double> twistShare;           // per node on a link: of its torsion, what lies between end0 and the node
  std::vector<Eigen::Vector3d> normal;      // unit, per node
  std::vector<double> attachmentStiffness;  // N/m per node; of the full surface
  std::vector<double> linkBulk, sphereBulk;  // N/m5, per host: pressure per volume between its nodes and anchors
  double largestPressure = 0;                // Pa
  std::vector<double> edgeStiffness;         // N/m per edge; of the full surface
  // Of identified links instead of spans and links: identified_mechanics.h.
  std::vector<Matrix6d> identifiedLinks;       // N/m
  std::vector<LinkStrains> identifiedStrains;  // per link; none where the network's cells have none
  std::vector<std::vector<SkinFrame>> skin;    // per node
  std::vector<double> normalExcess;            // N/m per node: what its attachment is stiffer along its normal
  std::vector<double> nodeMass;                // kg; 0 on skin
  std::vector<bool> nodeMoves;                 // per node: not fixed
  int firstLike = 0;  // the first body with this description but for pose and loads; set by World
  // Set by dampBody. s, damping over stiffness, Rayleigh's beta of links and surface; 1/s, damping over mass, his
  // alpha, and the one while bodies settle.
  double linkRelaxation = 0, surfaceRelaxation = 0, massDamping = 0, settlingDamping = 0;
  double lowestFrequency = 0;  // rad/s, of what deforms
};

// Throws std::runtime_error, without the body's name, where the description cannot be simulated.
BodyMechanics bodyMechanics(const BodyDescription& body);

double meanRadius(const SoftBodyModel& model);  // m, of its balls

}  // namespace medulla
