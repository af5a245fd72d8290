#pragma once

#include <Eigen/Core>
#include <vector>

#include "physics/dynamics/world.h"

// A body's links, springs or beams, from its tissue and its model's sections (physics/equations). Model frame.
namespace medulla {

// Where a link ends, and which part of the model's link lies between: not all of it where the surface around one end is
// held.
struct LinkSpan {
  Eigen::Vector3d end0, end1;  // m
  double from = 0, to = 1;
  bool clamped0 = false, clamped1 = false;  // the surface around the held sphere there is fixed; one of them at most
  // m, along the link's section axes U and V: how much farther out than `from` or `to` the clamp lies for bending
  // across them. Symmetric; nothing where the held surface's rim is flat.
  Eigen::Matrix2d beyond = Eigen::Matrix2d::Zero();
};

// Of a link whose middle lies there at rest, in the model's frame.
LinkFactors factorsAt(const BodyDescription& body, const Eigen::Vector3d& middle);

// Middles of the links that the body goes by, in the model's frame, m.
std::vector<Eigen::Vector3d> linkMiddles(const BodyDescription& body);

// One for each of the model's links. `moves` and `turns`: per sphere, what is not held. Throws std::runtime_error,
// without the body's name, where two linked spheres lie in one point.
std::vector<LinkSpan> linkSpans(const BodyDescription& body, const std::vector<bool>& moves,
                                const std::vector<bool>& turns);

// N m/rad about one section axis: moment at an end per flexion there, and at the other.
struct FlexionStiffness {
  double end0 = 0, end1 = 0;
  double couple = 0;  // 0 of springs
};

struct LinkStiffness {
  double elongation = 0;  // N/m
  FlexionStiffness flexionU, flexionV;
  double torsion = 0;     // N m/rad
  Eigen::Vector3d restU;  // unit, across the link: axis of flexionU. V = (centre line) x U
};

std::vector<LinkStiffness> linkStiffness(const BodyDescription& body, const std::vector<LinkSpan>& spans);

// The share of the link's torsion that lies before the place `along` its span: thin parts twist more.
double twistShare(const ElasticLink& link, const LinkSpan& span, double along);

}  // namespace medulla
