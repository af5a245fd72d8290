#include "physics/dynamics/identified_mechanics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "physics/model/cross_matrix.h"
#include "physics/model/disjoint_sets.h"
#include "physics/model/row_of_cells.h"
#include "physics/sort_unique.h"

namespace medulla {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void checkNetwork(const SoftBodyModel& m) {
  const IdentifiedNetwork& n = *m.identified;
  require(n.frames.size() == m.spheres.size() && n.skin.size() == m.restNodes.size(),
          fmt::format("its model identifies {} frames and {} nodes: expected {} and {}", n.frames.size(), n.skin.size(),
                      m.spheres.size(), m.restNodes.size()));
  const int spheres = static_cast<int>(m.spheres.size()), frames = spheres + static_cast<int>(n.patches.size());
  require(n.lengthScale > 0, fmt::format("its model's length scale is {}: expected more than 0 m", n.lengthScale));
  for (const IdentifiedLink& l : n.links) {
    require(l.frame0 >= 0 && l.frame0 < spheres && l.frame1 >= 0 && l.frame1 < frames && l.frame0 != l.frame1,
            fmt::format("its model identifies a link between frames {} and {}: expected two of 0 to {}, the first of a "
                        "sphere",
                        l.frame0, l.frame1, frames - 1));
    require((l.restPoint1 - l.restPoint0).norm() > 1e-9 * n.lengthScale,
            fmt::format("its model's frames {} and {} are linked and lie in one point", l.frame0, l.frame1));
  }
  for (std::size_t i = 0; i < n.skin.size(); ++i) {
    require(!n.skin[i].empty() && n.skin[i].size() <= kSkinFrames,
            fmt::format("its model hangs node {} on {} frames: expected 1 to {}", i, n.skin[i].size(), kSkinFrames));
    double sum = 0;
    for (const SkinFrame& f : n.skin[i]) {
      require(f.frame >= 0 && f.frame < frames,
              fmt::format("its model hangs node {} on frame {}: expected 0 to {}", i, f.frame, frames - 1));
      sum += f.weight;
      const auto same = [&f](const SkinFrame& other) { return other.frame == f.frame; };
      require(std::count_if(n.skin[i].begin(), n.skin[i].end(), same) == 1,
              fmt::format("its model hangs node {} on frame {} twice: expected once", i, f.frame));
    }
    require(std::abs(sum - 1) < 1e-6, fmt::format("the weights of its model's node {} sum to {}: expected 1", i, sum));
  }
}

}  // namespace

Vector3d armOf(const SoftBodyModel& m, int frame) {
  if (frame >= static_cast<int>(m.spheres.size())) return Vector3d::Zero();
  return m.identified->frames[frame].restPosition - m.spheres[frame].restFrame;
}

void checkIdentified(const BodyDescription& body) {
  const SoftBodyModel& m = *body.model;
  require(m.identified != nullptr, "its links are to be identified: expected a model built with --identify");
  const IdentifiedNetwork& n = *m.identified;
  require(!n.usesFormulas, "its model was identified as one of beams: expected beams as its links");
  checkNetwork(m);
  require(std::abs(n.poisson - body.tissue.poisson) < 1e-9,
          fmt::format("its model was identified for a Poisson's ratio of {}: its tissue has {}", n.poisson,
                      body.tissue.poisson));
  std::vector<int> held, fixed = body.fixedNodes;
  for (const FixedPatch& p : n.patches) held.insert(held.end(), p.nodes.begin(), p.nodes.end());
  for (std::vector<int>* nodes : {&held, &fixed}) sortUnique(*nodes);
  require(held == fixed,
          fmt::format("its model was identified with {} nodes held: expected the same ones, not these {}", held.size(),
                      fixed.size()));
  require(body.surface == SurfaceMode::skin || (n.layer.normal > 0 && n.layer.tangential > 0),
          "its model's surface layer has no stiffness: expected more than 0");
}

// What makes measures along the model's axes those along the link's, times the roots of their factors.
static Matrix6d steeredAxes(const BodyDescription& body, const IdentifiedLink& link) {
  const LinkFactors f = factorsAt(body, 0.5 * (link.restPoint0 + link.restPoint1));
  Vector6d steer;
  steer << f.elongation, f.flexion, f.flexion, f.torsion, f.flexion, f.flexion;
  Matrix6d axes = Matrix6d::Zero();
  axes.topLeftCorner<3, 3>() = axes.bottomRightCorner<3, 3>() = link.axes;
  return steer.cwiseSqrt().asDiagonal() * axes;
}

std::vector<Matrix6d> identifiedStiffness(const BodyDescription& body) {
  std::vector<Matrix6d> out;
  for (const IdentifiedLink& l : body.model->identified->links) {
    const Matrix6d steered = steeredAxes(body, l);
    const Matrix6d k = body.tissue.young * steered.transpose() * l.stiffness * steered;
    out.push_back(0.5 * (k + k.transpose()));
  }
  return out;
}

std::vector<LinkStrains> identifiedStrains(const BodyDescription& body) {
  std::vector<LinkStrains> out;
  if (!hasStrains(*body.model->identified)) return out;
  const double root = std::sqrt(body.tissue.young);
  for (const IdentifiedLink& l : body.model->identified->links) {
    const Matrix6d steered = root * steeredAxes(body, l).transpose();
    out.push_back({steered * l.strain0, steered * l.strain1});
  }
  return out;
}

// m2: second moments over the volume of the cells that a link joins, along it in sum and across where they are thinnest
// in the mean. What is held has none.
struct LinkedCells {
  int count = 0;
  double along = 0, thinnest = 0;
};
static LinkedCells cellsOf(const IdentifiedNetwork& network, const IdentifiedLink& link) {
  LinkedCells out;
  double thinnest = 0;
  for (const int frame : {link.frame0, link.frame1}) {
    if (frame >= static_cast<int>(network.frames.size()) || !(network.frames[frame].volume > 0)) continue;
    const IdentifiedFrame& cell = network.frames[frame];
    const Eigen::Matrix3d moments = link.axes * cell.secondMoment * link.axes.transpose() / cell.volume;
    const Eigen::Matrix2d section = moments.bottomRightCorner<2, 2>();
    const double mean = 0.5 * section.trace();
    thinnest += mean - std::sqrt(std::max(0.0, mean * mean - section.determinant()));
    out.along += moments(0, 0);
    ++out.count;
  }
  if (out.count > 0) out.thinnest = thinnest / out.count;
  return out;
}

static double lengthOf(const IdentifiedLink& link) {
  return (link.restPoint1 - link.restPoint0).norm();
}

std::vector<bool> barsAmong(const IdentifiedNetwork& network) {
  constexpr double kSlender = 2;  // as long as so many times its thickness
  const std::vector<IdentifiedLink>& links = network.links;
  const int cells = static_cast<int>(network.frames.size());
  std::vector<bool> out(links.size(), isRowOfCells(links, network.frames.size()));
  if (links.empty() || out[0]) return out;
  const auto join = [&](const IdentifiedLink& link, DisjointSets& sets) {
    return sets.join(link.frame0, std::min(link.frame1, cells));  // all patches as one: none moves
  };
  DisjointSets pieces(network.frames.size() + 1);
  for (std::size_t k = 0; k < out.size(); ++k) {
    DisjointSets others(network.frames.size() + 1);
    for (const IdentifiedLink& link : links)
      if (&link != &links[k]) join(link, others);
    out[k] = join(links[k], others);
    if (out[k]) join(links[k], pieces);
  }
  std::vector<double> length(network.frames.size() + 1, 0), thickness = length;  // m, m times m; by piece
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (!out[k]) continue;
    const int piece = pieces.of(links[k].frame0);
    length[piece] += lengthOf(links[k]);
    thickness[piece] += lengthOf(links[k]) * std::sqrt(12 * cellsOf(network, links[k]).thinnest);
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    const int piece = pieces.of(links[k].frame0);
    out[k] = out[k] && length[piece] * length[piece] > kSlender * thickness[piece];
  }
  return out;
}

LinkBending linkBending(const IdentifiedNetwork& network, const IdentifiedLink& link) {
  const LinkedCells cells = cellsOf(network, link);
  if (cells.count == 0) return {};
  const double length = lengthOf(link), nu = network.poisson, square = 4 * cells.thinnest / (length * length);
  return {0.5 * (0.395 - 0.433 * nu) * square, 0.25 * ((1 + nu) * square * length - cells.along / length), 2 * square};
}

std::vector<std::vector<SkinFrame>> heldSkin(const SoftBodyModel& model) {
  std::vector<std::vector<SkinFrame>> out = model.identified->skin;
  for (std::size_t p = 0; p < model.identified->patches.size(); ++p) {
    for (const int node : model.identified->patches[p].nodes) {
      SkinFrame alone;
      alone.frame = static_cast<int>(model.spheres.size() + p);
      alone.weight = 1;
      alone.restPoint = model.restNodes[node];
      out[node] = {alone};
    }
  }
  return out;
}

SphereCell sphereCell(const BodyDescription& body, int sphere) {
  const FillingSphere& s = body.model->spheres[sphere];
  if (!isIdentified(body)) return {s.volume, s.secondMoment};
  const IdentifiedFrame& f = body.model->identified->frames[sphere];
  const Vector3d arm = f.restPosition - s.restFrame;
  return {f.volume, f.secondMoment + f.volume * arm * arm.transpose()};
}

static Vector3d meanOf(const std::vector<SkinFrame>& frames) {
  Vector3d mean = Vector3d::Zero();
  for (const SkinFrame& f : frames) mean += f.weight * f.restPoint;
  return mean;
}

std::vector<SkinRow> skinRows(const SoftBodyModel& model, const std::vector<SkinFrame>& frames, int node) {
  const double scale = model.identified->lengthScale;
  const Vector3d mean = meanOf(frames);
  // Of the blended frame: its way, and its turn with what it carries.
  Matrix3d ofMean = Matrix3d::Identity(), ofTurn = -crossMatrix(model.restNodes[node] - mean);
  for (const SkinFrame& f : frames) {
    const Matrix3d way = f.map.leftCols<3>(), turn = scale * f.map.rightCols<3>();
    ofMean -= way;
    ofTurn += way * crossMatrix(f.restPoint - mean) - turn;
  }
  std::vector<SkinRow> out;
  out.reserve(frames.size());
  for (const SkinFrame& f : frames)
    out.push_back({f.weight * ofMean + f.map.leftCols<3>(), f.weight * ofTurn + scale * f.map.rightCols<3>()});
  return out;
}

Vector3d skinLever(const SoftBodyModel& model, const std::vector<SkinFrame>& frames, int node) {
  const Vector3d mean = meanOf(frames);
  Vector3d lever = model.restNodes[node] - mean;
  for (const SkinFrame& f : frames) lever -= f.map.leftCols<3>().trace() / 3 * (f.restPoint - mean);
  return lever;
}

// t' = v1 - v0 - (omega0 + omega1) / 2 x d, w' = omega1 - omega0, with the velocities of the cells' frames.
RestMeasures restMeasures(const SoftBodyModel& model, const IdentifiedLink& link) {
  const double scale = model.identified->lengthScale;
  const Matrix3d half = 0.5 * crossMatrix(link.restPoint1 - link.restPoint0), one = scale * Matrix3d::Identity();
  RestMeasures out;
  out.line << Matrix3d::Identity(), Matrix3d::Zero();
  out.turn0 << half + crossMatrix(armOf(model, link.frame0)), -one;
  out.turn1 << half - crossMatrix(armOf(model, link.frame1)), one;
  return out;
}

}  // namespace medulla
