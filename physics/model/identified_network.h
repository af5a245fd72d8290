#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <vector>

// What a finite-element solve of the very mesh, done once and offline, leaves for run time: links between the filling
// spheres' frames and to the patches that a scene holds, a skin that hangs each node on several frames, stiffnesses of
// the surface layer, and masses. Model frame, metres. Stiffnesses are per pascal of Young's modulus: linear elasticity
// scales with it, not with Poisson's ratio.
namespace medulla {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

// Of one filling sphere, in the spheres' order: the frame that moves as its cell does in the mean.
struct IdentifiedFrame {
  Eigen::Vector3d restPosition = Eigen::Vector3d::Zero();  // m, centroid of the cell
  double volume = 0;                                       // m3 of the cell, its surface nodes' share included
  Eigen::Matrix3d secondMoment = Eigen::Matrix3d::Zero();  // m5, integral of r r^T over the cell about restPosition
};

// A part of the surface that scenes hold. Its frame does not move and turns with nothing; it follows the spheres'
// frames in all numbering: frame number spheres + k is patch k.
struct FixedPatch {
  std::string region;      // as on the command line: "box=...", "sphere=...", "plane=...", "vertices=..."
  std::vector<int> nodes;  // of the model, ascending
};

// Energy m^T stiffness m / 2 times Young's modulus, with the measures m = (axes t, lengthScale axes w) of
//   w = log(R0^T R1),  Rm = R0 exp(w/2),  t = Rm^T (x1 - x0) - S(w) (restPoint1 - restPoint0)
// where x and R are the two frames' positions and rotations since rest, and S(w) shortens and turns the rest line as
// an arc of that bending does: S d = (sin h / h) d + (1 - sin h / h) / |w|^2 w (w.d), h = |w| / 2.
// A patch's frame stands at the link's restPoint1 (its point nearest to the sphere; in a row of cells where the link is
// clamped) and has R = 1.
//
// Each cell stores (its strain)^2 / 2 besides, times Young's modulus: the sum of strain0 . m over the links that have
// it as frame0 and of strain1 . m over those that have it as frame1. Links with a stiffness each, none negative, know
// Poisson's ratios up to a quarter only; what nearly keeps its volume, and bulges at all other neighbours where one
// presses, takes a stiffness that couples them.
struct IdentifiedLink {
  int frame0 = 0, frame1 = 0;                            // frame0 is a sphere
  Eigen::Vector3d restPoint0 = Eigen::Vector3d::Zero();  // m, frame0's restPosition
  Eigen::Vector3d restPoint1 = Eigen::Vector3d::Zero();  // m
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();    // rows: along, u, v; right-handed, unit
  Matrix6d stiffness = Matrix6d::Zero();                 // m: N/m per Pa; positive semidefinite
  Vector6d strain0 = Vector6d::Zero();                   // m^1/2: root of N/m per Pa
  Vector6d strain1 = Vector6d::Zero();                   // likewise; 0 of a patch
};

// A node hangs on so many frames at most; four are nearly as good, one is bad.
constexpr int kSkinFrames = 6;

// One of the frames a node hangs on. Node: x = X + sum over its frames of `map` (displacement of the frame,
// lengthScale times its rotation), both small and seen in the frame into which the frames blend:
//   xb = sum weight x_k,  Rb = R_0 exp(sum weight log(R_0^T R_k)),
//   u_k = Rb^T (x_k - xb) - (restPoint_k - Xb),  Xb = sum weight restPoint_k,  th_k = log(Rb^T R_k),
//   node = xb + Rb (X - Xb + sum map_k (u_k, lengthScale th_k)).
// Rigid motion of all frames moves the node rigidly.
struct SkinFrame {
  int frame = 0;
  double weight = 0;                                    // 1 in sum over the node's frames
  Eigen::Vector3d restPoint = Eigen::Vector3d::Zero();  // m; a patch's is its point nearest to the node
  Eigen::Matrix<double, 3, 6> map = Eigen::Matrix<double, 3, 6>::Zero();
};

struct IdentifiedLayer {              // springs between nodes and where their frames carry them
  double normal = 0, tangential = 0;  // 1/m: N/m per m2 of surface and Pa
  double membrane = 0;                // m: thickness t in k = E t sum(areas) / length^2 of an edge
};

// The bulk modulus over Young's, by which each cell resists that its surface swells beside what the frames carry: at
// run time and where the layer is fitted. Beyond 2.5 it hardly brings a poke nearer and bounds the step.
inline double identifiedBulk(double poisson) {
  return std::min(1 / (3 * (1 - 2 * poisson)), 2.5);
}

struct IdentifiedError {  // % of each load's largest displacement, over loads that nothing was fitted to
  double maximum = 0, rms = 0;
};

struct IdentifiedNetwork {
  double poisson = 0.45;
  double lengthScale = 0;  // m, makes rotations and displacements alike
  double voxel = 0;        // m, of the finite elements
  std::vector<IdentifiedFrame> frames;
  std::vector<FixedPatch> patches;
  // Ascending: frames whose cells lie behind the patches, but for a twentieth at most. They stand still.
  std::vector<int> heldFrames;
  std::vector<IdentifiedLink> links;
  std::vector<std::vector<SkinFrame>> skin;  // per node
  IdentifiedLayer layer;
  IdentifiedError bulk, poke, ofFiniteElements;  // the last: against a grid of another size
  bool usesFormulas = false;  // the beams' formulas did better on the builder's own loads: links and skin are empty
};

inline bool hasStrains(const IdentifiedNetwork& network) {
  return std::any_of(network.links.begin(), network.links.end(),
                     [](const IdentifiedLink& l) { return !l.strain0.isZero(0) || !l.strain1.isZero(0); });
}

}  // namespace medulla
