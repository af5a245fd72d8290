#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "physics/model/identified_network.h"

// What is known of a body before it moves: made once from a closed mesh, shared by every body that uses it, never
// changed. Everything is in the frame of the mesh ("model frame"), in metres, and free of material: density and
// stiffness come with the scene.
namespace medulla {

// A filling sphere (paper 2.2): a ball, which is geometry, and a frame, which is mechanics.
struct FillingSphere {
  Eigen::Vector3d restBallCentre = Eigen::Vector3d::Zero();  // m; sticks out by an overshoot at most; for contact
  double radius = 0;                                         // m
  // m; the mass sits here: centroid of the power cell less the shares of its surface nodes (node_volumes.h), of the
  // whole cell where nodes carry no mass.
  Eigen::Vector3d restFrame = Eigen::Vector3d::Zero();
  // m; the links end here: at the frame, or, where a chain ends in the sphere, farther out (link_ends.h).
  Eigen::Vector3d restLinkEnd = Eigen::Vector3d::Zero();
  double volume = 0;  // m3 of the power cell, the share of its surface nodes included
  Eigen::Matrix3d secondMoment = Eigen::Matrix3d::Zero();  // m5, integral of r r^T over that cell about restFrame
};

// The body's section across a link.
struct LinkSection {
  double area = 0;             // m2
  double bendingMomentU = 0;   // m4, second moment of area that resists bending about restU
  double bendingMomentV = 0;   // m4, the same about restV
  double torsionConstant = 0;  // m4, Saint-Venant
};

// An elastic link (paper 2.2, figure 3) between the link ends of two spheres.
struct ElasticLink {
  static constexpr int kSections = 9;  // of equal lengths of the link, each measured in its middle, from sphere0 on
  int sphere0 = 0, sphere1 = 0;
  std::array<LinkSection, kSections> sections;
  Eigen::Vector3d restU = Eigen::Vector3d::Zero();  // unit, perpendicular to the centre line; V = (centre line) x U;
                                                    // principal axes of the mean section
};

// How a surface node hangs on the skeleton (paper 2.3).
struct Attachment {
  bool onLink = false;
  int host = 0;      // link index if onLink, else sphere index
  double along = 0;  // 0..1 from sphere0 to sphere1 of the link; 0 on a sphere
  // m, model frame, from the anchor on the skeleton to the node; perpendicular to a link
  Eigen::Vector3d restOffset = Eigen::Vector3d::Zero();
  double area = 0;     // m2, a third of the triangles around the node
  double volume = 0;   // m3, share of the body's volume whose mass the node carries when it is dynamic
  int massSphere = 0;  // the sphere whose cell that volume is taken from
};

// The surface that is drawn, evaluated from the nodes: x = sum w_i x_i + frame * offset, where the frame's columns are
// t0 = normalised sum a_i x_i, n = normalised (sum a_i x_i) x (sum b_i x_i), and n x t0 in the middle: (t0, n x t0, n).
// w is the Loop limit position, a and b the Loop limit tangents (Loop 1987; Biermann, Levin and Zorin 2000).
struct RenderSurface {
  std::vector<int> first;  // size vertices + 1: stencil of vertex k is [first[k], first[k+1])
  std::vector<int> node;
  std::vector<float> weight, tangent0, tangent1;
  std::vector<std::array<float, 3>> offset;        // m, in the frame above; zero where no fine shape is given
  std::vector<std::array<float, 3>> restPosition;  // m, model frame: drives textures
  std::vector<std::array<int, 3>> triangles;
};

// Raw result of the edge collapse of Li et al. (paper 2.1): kept for the model view.
struct Skeleton {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<std::array<int, 2>> links;
};

struct SoftBodyModel {
  std::string name;            // of the mesh file, without folder and extension
  std::uint64_t meshHash = 0;  // FNV-1a of the input mesh's vertices and triangles, before repair
  std::string settings;        // the build settings, as the command line that repeats them

  std::vector<int> nodeOfInputVertex;  // -1 where repair dropped the vertex
  std::vector<Eigen::Vector3d> restNodes;
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::array<int, 2>> edges;  // lower node first, sorted

  std::vector<FillingSphere> spheres;
  std::vector<ElasticLink> links;
  std::vector<Attachment> attachments;    // one per node
  std::vector<std::vector<int>> buckets;  // triangles of each sphere; every triangle in exactly one (paper 4)
  Skeleton skeleton;
  RenderSurface renderSurface;
  std::shared_ptr<const IdentifiedNetwork> identified;  // optional: build --identify
};

}  // namespace medulla
