#include "physics/dynamics/node_give.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "physics/dynamics/rest_measures.h"
#include "physics/dynamics/rigid_support.h"

namespace medulla {

namespace {

using Eigen::VectorXd;

// A spring k between a mode (mass m, stiffness K, damping c) at rest and a device that sets out at an even speed takes
// the mode along, within T, by the part k / (k + K) (1 - sin z / z) of the way, z^2 = (k + K) T^2 / m, or, without
// mass, by (1 - (1 - exp(-z)) / z), z = (k + K) T / c. z^2 / (z^2 + 6) and z / (z + 2) are the same for short times and
// less for all others that matter: as if the mode were stiffer by 6 m / T^2 and 2 c / T. Damping over mass is small
// against the former where modes are slow, and knows no rigid motion. In n substeps, of which each moves by the
// velocity at its end, a mass goes (1 + 1 / n) (1 + 2 / n) times as far.
RestRates stiffnessWithin(const FrameSteps& steps, const BodyDescription& body, const BodyMechanics& mechanics,
                          const RestRates& nodes) {
  const RestRates links = linkRates(*body.model, mechanics);
  const double n = steps.count, duration = steps.count * steps.substep;
  const double damped = 1 + 2 * mechanics.linkRelaxation / duration;
  const double inert = 6 / (duration * duration * (1 + 1 / n) * (1 + 2 / n));
  RestRates out =
      damped * RestRates(links.transpose() * links) +
      inert * RestRates(sphereMasses(mechanics) + RestRates(nodes.transpose() * (nodeMasses(mechanics) * nodes)));
  if (holdsByNodes(body)) {
    const RestRates held = heldNodeRates(body, mechanics);
    out += RestRates(held.transpose() * held);
  }
  return out;
}

// 0 in rows of freedoms that are fixed.
VectorXd onFree(const BodyMechanics& mechanics, VectorXd forces) {
  for (std::size_t i = 0; i < mechanics.moves.size(); ++i) {
    const auto at = 6 * static_cast<Eigen::Index>(i);
    if (!mechanics.moves[i]) forces.segment<3>(at).setZero();
    if (!mechanics.turns[i]) forces.segment<3>(at + 3).setZero();
  }
  return forces;
}

void setCarried(const BodyDescription& body, const BodyMechanics& mechanics, const FrameSteps& steps,
                std::vector<NodeGive>& out) {
  const RestRates nodes = anchorRates(body, mechanics);
  Eigen::SparseMatrix<double> stiffness = stiffnessWithin(steps, body, mechanics, nodes);
  const VectorXd free = onFree(mechanics, VectorXd::Ones(stiffness.rows()));
  stiffness = Eigen::SparseMatrix<double>(free.asDiagonal() * stiffness * free.asDiagonal()) +
              Eigen::SparseMatrix<double>((VectorXd::Ones(free.size()) - free).asDiagonal());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(stiffness);
  // Of many nodes each asks for few of the same columns; these are 130 MB at most.
  constexpr Eigen::Index kMostColumns = 4096;
  const Eigen::Index columns = stiffness.rows();
  Eigen::MatrixXd compliance;
  if (columns <= std::min(kMostColumns, static_cast<Eigen::Index>(out.size())))
    compliance = factor.solve(Eigen::MatrixXd::Identity(columns, columns));
  for (std::size_t n = 0; n < out.size(); ++n) {
    if (!mechanics.nodeMoves[n] && holdsByNodes(body)) continue;
    const VectorXd push = onFree(mechanics, nodes.middleRows(3 * n, 3).transpose() * mechanics.normal[n]);
    if (compliance.size() == 0) {
      out[n].carried = push.dot(factor.solve(push));
      continue;
    }
    const Eigen::SparseVector<double> few = push.sparseView();
    using Entry = Eigen::SparseVector<double>::InnerIterator;
    for (Entry j(few); j; ++j) {
      double way = 0;
      for (Entry i(few); i; ++i) way += i.value() * compliance(j.index(), i.index());
      out[n].carried += j.value() * way;
    }
  }
}

void setOwn(const BodyDescription& body, const BodyMechanics& mechanics, std::vector<NodeGive>& out) {
  const std::vector<std::array<int, 2>>& edges = body.model->edges;
  std::vector<double> own = mechanics.attachmentStiffness, all;  // N/m
  for (std::size_t i = 0; i < mechanics.normalExcess.size(); ++i) own[i] += mechanics.normalExcess[i];
  all = own;
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (const int n : edges[e]) all[n] += mechanics.edgeStiffness[e];
  for (std::size_t e = 0; e < edges.size(); ++e) {
    for (int k = 0; k < 2; ++k) {
      const int beside = edges[e][1 - k];
      const double stiffness = mechanics.edgeStiffness[e];
      const bool yields = mechanics.nodeMoves[beside] && all[beside] > 0;
      own[edges[e][k]] += yields ? stiffness * (1 - stiffness / all[beside]) : stiffness;
    }
  }
  for (std::size_t i = 0; i < out.size(); ++i)
    if (mechanics.nodeMoves[i] && own[i] > 0) out[i].own = 1 / own[i];
}

}  // namespace

std::vector<NodeGive> nodeGive(const BodyDescription& body, const BodyMechanics& mechanics, const FrameSteps& steps) {
  std::vector<NodeGive> out(body.model->restNodes.size());
  if (body.surface != SurfaceMode::skin) setOwn(body, mechanics, out);
  setCarried(body, mechanics, steps, out);
  return out;
}

}  // namespace medulla
