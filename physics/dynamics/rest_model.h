#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/identified_mechanics.h"
#include "physics/dynamics/rest_measures.h"

namespace medulla {

// A body linearised at rest: M x'' + K x = 0, K of links and of the surface apart. Freedoms: 6 per sphere (velocity,
// angular velocity), then 3 per node of a surface that is not a skin. SI units. Keeps references to both arguments.
class RestModel {
 public:
  RestModel(const BodyDescription& body, const BodyMechanics& mechanics);

  int size() const { return 6 * spheres_ + 3 * nodes_; }

  // (links * K_links + surface * K_surface) x
  Eigen::VectorXd stiffnessTimes(const Eigen::VectorXd& x, double links, double surface) const;

  // 1/s2: the largest eigenvalue of M^-1 (links * K_links + surface * K_surface) over what is not fixed, within a
  // thousandth; throws std::runtime_error where a stiffness over a mass is not finite.
  double largestEigenvalue(double links, double surface) const;

  // N m per rad: the stiffness that sphere i turns against while all else stands still.
  Eigen::Matrix3d turningStiffness(int i) const;

  // Stiffness of the links, and mass with the nodes' through their anchors' motion J: M + J^T m J. 6 spheres square.
  Eigen::MatrixXd linkStiffness() const;
  Eigen::MatrixXd carriedMass() const;

  // Where the spheres' motions (6 spheres x loads) carry the nodes, and what forces on the nodes do to the spheres.
  Eigen::MatrixXd carried(const Eigen::MatrixXd& motions) const;
  Eigen::MatrixXd onSpheres(const Eigen::MatrixXd& forces) const;

  // A repeatable, structureless start vector: the fractional parts of multiples of the golden ratio.
  static double startValue(int i);

 private:
  // An anchor on a link, at rest.
  struct LinkAnchor {
    int s0, s1;  // the spheres' places in the vector of freedoms
    double along, twistShare, length, thinning;
    Eigen::Vector3d n, arm0, arm1, offset;
    double bump;  // m, of the centre line per turn of its ends against each other (anchor.h); 0 where it stays a chord
  };

  int node(int i) const { return 6 * spheres_ + 3 * i; }
  std::vector<int> hostsOf(int i) const;
  LinkAnchor linkAnchor(int i) const;
  void addLinks(const Eigen::VectorXd& x, double scale, Eigen::VectorXd& y) const;
  void addStrains(const Eigen::VectorXd& x, double scale, Eigen::VectorXd& y) const;
  void addSurface(const Eigen::VectorXd& x, double scale, Eigen::VectorXd& y) const;
  Eigen::Vector3d anchorRate(int i, const Eigen::VectorXd& x) const;
  void addAnchorLoad(int i, const Eigen::Vector3d& f, Eigen::VectorXd& y) const;
  Eigen::VectorXd timesMass(const Eigen::VectorXd& x) const;
  Eigen::VectorXd divideByMass(const Eigen::VectorXd& x) const;

  const SoftBodyModel& model_;
  const BodyMechanics& mechanics_;
  std::vector<MeasureRow> rows_;
  std::vector<StrainRow> strains_;
  std::vector<Eigen::Matrix3d> inverseInertia_;
  std::vector<std::vector<HostRate>> hosts_;  // per node of an identified body; empty of others
  bool isBeam_;
  double thinning_;  // relative, of what hangs on a link, per relative stretch
  int spheres_, nodes_;
};

}  // namespace medulla
