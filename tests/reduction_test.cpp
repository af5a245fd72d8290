#include "physics/model/identify/reduction.h"

#include <gtest/gtest.h>

#include "physics/model/identify/check_loads.h"
#include "physics/model/identify/end_loads.h"
#include "physics/model/identify/link_fit.h"
#include "physics/model/symmetric_eigen.h"
#include "tests/reduced_cylinder.h"

// Finite elements reduced to frames of cells, and what twisted ends of rows add.
namespace medulla {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

const Reduced& heldCylinder() {
  static const Reduced reduced = reduceCylinder(true);
  return reduced;
}

TEST(CellFrames, FollowRigidMotionAndHaveTheMeshsMass) {
  const Reduced& r = heldCylinder();
  const Vector3d centre(0.03, -0.2, 0.1);
  const MatrixXd grid = rigidMotions(r.solid.grid.nodes, centre, 3, r.cells.lengthScale),
                 frames = rigidMotions(placesOf(r.cells), centre, 6, r.cells.lengthScale);
  EXPECT_LT((r.cells.motion * grid - frames).norm(), 1e-10 * frames.norm());
  double volume = 0;
  for (const IdentifiedFrame& f : r.cells.frames) volume += f.volume;
  EXPECT_NEAR(volume / massProperties(r.mesh).volume, 1, 1e-12);
}

TEST(Reduction, StiffnessIsThatOfTheDirectSolution) {
  const Reduced& r = heldCylinder();
  VectorXd load(r.responses.frames.rows());
  for (Index k = 0; k < load.size(); ++k) load[k] = std::sin(2. * static_cast<double>(k) + 1);
  RowMatrix x = r.cells.motion.transpose() * load;
  solve(r.solid.plan, r.solid.factors, x);
  const VectorXd moved = r.cells.motion * x;
  EXPECT_LT((solvePositive(r.responses.frames, moved) - load).norm(), 1e-8 * load.norm());
  EXPECT_LT((r.responses.nodes * load - r.solid.surface * x).norm(), 1e-10 * x.norm());
}

TEST(Reduction, AFreeBodyResistsNoRigidMotion) {
  const Reduced r = reduceCylinder(false);
  const Responses free = balancedResponses(r.mesh, r.cells, r.responses);
  const Index n = free.frames.rows();
  const MatrixXd stiffness = solvePositive(free.frames, MatrixXd::Identity(n, n)) - free.grounding;
  const MatrixXd rigid = rigidMotions(placesOf(r.cells), {0, 0, 0}, 6, r.cells.lengthScale);
  EXPECT_LT((stiffness * rigid).norm(), 1e-8 * stiffness.norm() * rigid.norm());
  const VectorXd own = eigenvaluesOf(stiffness, MatrixXd::Identity(n, n));
  EXPECT_LT(std::abs(own[5]), 1e-8 * own[n - 1]);
  EXPECT_GT(own[6], 1e-6 * own[n - 1]) << "six rigid motions and no more";
  // Whatever the pins: nodes ride rigidly along.
  const MatrixXd nodes = free.nodes * solvePositive(free.frames, rigid);
  EXPECT_LT((nodes - rigidMotions(r.mesh.vertices, {0, 0, 0}, 3, r.cells.lengthScale)).norm(), 1e-8 * nodes.norm());
}

struct Ends {
  std::vector<FixedPatch> patches;
  std::vector<IdentifiedLink> links;
  EndTwists twists;
};

Ends endsOf(const Reduced& r) {
  Ends out;
  if (!r.heldTriangles.empty()) {
    FixedPatch& patch = out.patches.emplace_back();
    for (std::size_t n = 0; n < r.mesh.vertices.size(); ++n)
      if (r.mesh.vertices[n].x() < 1e-6) patch.nodes.push_back(static_cast<int>(n));
  }
  out.links = layOutLinks(r.mesh, r.cells, out.patches, {r.heldTriangles});
  out.twists = solveEnds(r.mesh, r.solid, r.cells, out.links, freeAreas(measureNodes(r.mesh, out.patches)));
  return out;
}

TEST(EndLoads, TheFreeEndOfARowIsTwistedBeyondItsFrame) {
  const Reduced& r = heldCylinder();
  const EndTwists ends = endsOf(r).twists;
  ASSERT_EQ(ends.cells.size(), 1u) << "the other end's cell has a link to what is held, too";
  const Vector3d from = r.cells.frames[ends.cells[0]].restPosition;
  for (const IdentifiedFrame& f : r.cells.frames) EXPECT_LE(f.restPosition.x(), from.x());
  EXPECT_GT(std::abs(ends.axes[0](0, 0)), 0.999);

  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();
  double size = 0;
  for (std::size_t n = 0; n < r.mesh.vertices.size(); ++n) {
    const Vector3d f = ends.forces.block<3, 1>(3 * static_cast<Index>(n), 0);
    force += f;
    moment += (r.mesh.vertices[n] - from).cross(f);
    size += f.norm();
  }
  EXPECT_LT(force.norm(), 0.02 * size);
  EXPECT_GT(moment.x(), 0.9 * 0.01 * size) << "at 10 mm from the axis";
  EXPECT_LT(moment.tail<2>().norm(), 0.02 * moment.x());
}

// The forces' motions by Maxwell and Betti: a node's displacement under a unit load on a frame is that frame's under a
// unit force on the node. The finite elements' own loads have a few percent less moment than the tractions.
TEST(EndLoads, FramesFollowAsUnitLoadsOnThemTell) {
  const Reduced& r = heldCylinder();
  const EndTwists ends = endsOf(r).twists;
  const VectorXd expected = r.responses.nodes.transpose() * ends.forces.col(0);
  EXPECT_LT((ends.frames.col(0) - expected).norm(), 0.08 * expected.norm());
  EXPECT_GT(ends.frames(6 * ends.cells[0] + 3, 0), 0.9 * expected.tail<3>().norm());
}

TEST(EndLoads, UnitLoadsButForTheTwistGiveWhatTheComplianceSays) {
  const Reduced& r = heldCylinder();
  const EndTwists ends = endsOf(r).twists;
  const MatrixXd skin = MatrixXd::Random(ends.forces.rows(), r.responses.frames.rows());
  const LoadsOnCells loads = loadsOnEnds(ends, r.responses.frames, skin.sparseView());
  ASSERT_EQ(loads.loads.cols(), 6);
  EXPECT_LT((loads.loads.col(3) - skin.transpose() * ends.forces.col(0)).norm(), 1e-12 * loads.loads.col(3).norm());
  EXPECT_EQ(loads.motions.col(3), ends.frames.col(0));
  for (const int k : {0, 1, 2, 4, 5}) {
    EXPECT_NEAR(loads.loads.col(k).norm(), 1, 1e-12);
    EXPECT_NEAR(loads.loads.col(k).segment<6>(6 * ends.cells[0]).norm(), 1, 1e-12) << "on the end's cell alone";
    EXPECT_LT((loads.motions.col(k) - r.responses.frames * loads.loads.col(k)).norm(), 1e-12 * loads.motions.norm());
  }
  const Vector3d across = loads.loads.col(4).segment<3>(6 * ends.cells[0] + 3);
  EXPECT_LT(std::abs(across.dot(ends.axes[0].row(0))), 1e-12) << "a couple across the link";
}

TEST(EndLoads, FreeBodiesAndCellsSideBySideHaveNone) {
  EXPECT_TRUE(endsOf(reduceCylinder(false)).twists.cells.empty());
  const Reduced& r = heldCylinder();
  Ends braced = endsOf(r);
  for (const IdentifiedLink& link : std::vector<IdentifiedLink>(braced.links)) braced.links.push_back(link);
  EXPECT_TRUE(
      solveEnds(r.mesh, r.solid, r.cells, braced.links, VectorXd::Ones(static_cast<Index>(r.mesh.vertices.size())))
          .cells.empty());
}

}  // namespace
}  // namespace medulla
