#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/rest_measures.h"

namespace medulla {

// A body linearised at rest: M x'' + K x = 0, K of links and of the surface apart. Freedoms: 6 per sphere (velocity,
// angular velocity), then 3 per node of a surface that is not a skin. SI units. Masses, and what
// is fixed, come with each question: those that differ share the stiffness.
class RestModel {
 public:
  RestModel(const BodyDescription& body, const BodyMechanics& mechanics);

  int size() const { return 6 * spheres_ + 3 * nodes_; }

  // (links * K_links + surface * K_surface) x
  Eigen::VectorXd stiffnessTimes(const Eigen::VectorXd& x, double links, double surface) const;

  // 1/s2: the largest eigenvalue of M^-1 (links * K_links + surface * K_surface) over what is not fixed, with `spheres`
  // more of the spheres' freedoms, within a thousandth; throws std::runtime_error where a stiffness over a mass is not
  // finite.
  double largestEigenvalue(const BodyMechanics& masses, double links, double surface, double spheres = 0) const;

  // N m per rad: the stiffness that sphere i turns against while all else stands still.
  Eigen::Matrix3d turningStiffness(int i) const;

  // Stiffness of the links, and mass with the nodes' through their anchors' motion J: M + J^T m J. 6 spheres square.
  Eigen::MatrixXd linkStiffness() const;
  Eigen::MatrixXd carriedMass(const BodyMechanics& masses) const;

  // Where the spheres' motions (6 spheres x loads) carry the nodes, and what forces on the nodes do to the spheres.
  Eigen::MatrixXd carried(const Eigen::MatrixXd& motions) const;
  Eigen::MatrixXd onSpheres(const Eigen::MatrixXd& forces) const;

  // A repeatable, structureless start vector (SplitMix64: Steele, Lea and Flood 2014). Of what grows evenly from one
  // sphere to the next second differences are 0, and with them the share of a mode of three like spheres in a row.
  static double startValue(int i);

 private:
  Eigen::VectorXd carriedBy(const Eigen::VectorXd& spheres) const;
  void addOnSpheres(const Eigen::VectorXd& forces, Eigen::VectorXd& y) const;

  int spheres_, nodes_;
  RestRates links_, layer_, pressure_;          // rest_measures.h
  std::vector<std::vector<HostRate>> anchors_;  // per node, of a skin's, too
};

}  // namespace medulla
