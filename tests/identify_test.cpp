#include "physics/model/identify/identify.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <limits>
#include <numbers>

#include "physics/dynamics/fixation.h"
#include "physics/dynamics/world.h"
#include "physics/model/identify/check_loads.h"
#include "physics/model/identify/held_give.h"
#include "physics/model/identify/held_rim.h"
#include "physics/model/identify/hex_stiffness.h"
#include "physics/model/identify/lbfgs.h"
#include "physics/model/identify/reduction.h"
#include "physics/model/symmetric_eigen.h"
#include "tests/complaint.h"
#include "tests/reduced_cylinder.h"
#include "tests/test_shapes.h"

// What `medulla build --identify` finds: finite elements against analytic answers, the reduction against finite
// elements, the network against both.
namespace medulla {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

VoxelBody voxelsOf(const TriangleMesh& mesh, double cellSize) {
  const double volume = massProperties(mesh).volume, voxel = cellSize / HexGrid::kVoxels;
  return voxeliseEvenly(mesh, volume, static_cast<int>(volume / (voxel * voxel * voxel)));
}

HeldRegion endOfCylinder(const TriangleMesh& mesh) {
  HeldRegion region{"plane=1,0,0,0.001", {}, true};
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
    if (mesh.vertices[n].x() <= 1e-3) region.nodes.push_back(static_cast<int>(n));
  return region;
}

const Identification& heldCylinder() {
  static const Identification found = identifyNetwork(cylinderModel(), {endOfCylinder(cylinder())}, {});
  return found;
}

const Identification& freeCylinder() {
  static const Identification found = identifyNetwork(cylinderModel(), {}, {});
  return found;
}

// The patch test on cells that the surface cuts: a field of constant strain stores its energy density times what is
// inside of the cell, and a thousandth of the cell.
TEST(HexGrid, CutCellsStoreWhatConstantStrainSays) {
  const VoxelBody voxels = voxelsOf(ellipsoidMesh(3, {0.05, 0.04, 0.03}), 0.012);
  const HexGrid grid = makeHexGrid(voxels);
  std::vector<double> fractions(grid.cells.size(), 0);
  for (const VoxelPiece& piece : voxels.pieces) {
    const auto at = [&](int a) { return piece.index[a] / HexGrid::kVoxels; };
    const int cell = grid.cellAt[(at(0) * grid.count[1] + at(1)) * grid.count[2] + at(2)];
    if (cell >= 0) fractions[cell] += piece.volume / std::pow(grid.size, 3);
  }
  const double poisson = 0.3, lambda = poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = 1 / (2 * (1 + poisson));
  Matrix3d gradient;
  gradient << 0.3, -0.1, 0.2, 0.4, 0.25, -0.3, 0.1, 0.6, -0.2;
  const Matrix3d strain = (gradient + gradient.transpose()) / 2;
  const double density = lambda / 2 * strain.trace() * strain.trace() + mu * strain.squaredNorm();
  const MatrixXd perPoint = stiffnessPerPoint(poisson);
  int cut = 0;
  for (int c = 0; c < static_cast<int>(grid.cells.size()); ++c) {
    const MatrixXd k = hexStiffness(grid, perPoint, std::array{c}).reshaped(kHexFreedoms, kHexFreedoms);
    VectorXd u(kHexFreedoms), rigid(kHexFreedoms);
    for (int a = 0; a < kHexNodes; ++a) {
      const Vector3d x = grid.nodes[grid.cellNodes[c][a]];
      u.segment<3>(3 * a) = gradient * x;
      rigid.segment<3>(3 * a) = Vector3d(0.2, -0.1, 0.5).cross(x) + Vector3d(1, 2, 3);
    }
    const double volume = (fractions[c] + 1e-3) * std::pow(grid.size, 3);
    EXPECT_NEAR(u.dot(k * u) / 2 / (density * volume), 1, 1e-9) << fractions[c];
    EXPECT_LT((k * rigid).norm(), 1e-12 * k.norm() * rigid.norm());
    cut += fractions[c] < 0.99;
  }
  EXPECT_GT(cut, 30);
}

// Thickness cubed bends a plate: the second moment across it, of the material that cells are filled with.
TEST(HexGrid, APlateIsAsThickWhicheverWayItLies) {
  const double length = 0.2, thickness = 0.01;
  for (int across = 0; across < 3; ++across) {
    Vector3d size = Vector3d::Constant(length);
    size[across] = thickness;
    const HexGrid grid = makeHexGrid(voxelsOf(boxMesh(size), 0.0064));
    double second = 0;
    for (std::size_t c = 0; c < grid.cells.size(); ++c) {
      for (int q = 0; q < kHexGauss; ++q) {
        const std::array<int, 3> at = {q / 25, q / 5 % 5, q % 5};
        const double x =
            grid.low[across] + grid.size * (grid.cells[c][across] + fivePointRule().points[at[across]]) - thickness / 2;
        second += std::pow(grid.size, 3) * grid.weights(q, static_cast<Index>(c)) * x * x;
      }
    }
    EXPECT_NEAR(second / (length * length * std::pow(thickness, 3) / 12), 1, 0.015) << across;
  }
}

// Beyond the answers of finite elements there are fits to thousands of nodes: they tell how far they are, too.
TEST(Identify, FitsOfTheSurfaceSayThatTheyGoOn) {
  int calls = 0;
  identifyNetwork(cylinderModel(), {endOfCylinder(cylinder())}, {}, [&](double part) {
    calls += part > 0.93 && part < 1;
    EXPECT_LE(part, 1);
  });
  EXPECT_GT(calls, 10);
}

TEST(VoxelSolid, UniformTractionStrainsAFreeBodyUniformly) {
  const TriangleMesh mesh = ellipsoidMesh(4, {0.05, 0.04, 0.03});
  const double poisson = 0.3;
  const VoxelSolid solid = makeVoxelSolid(mesh, 0.01, {poisson, {}, {}});
  EXPECT_EQ(metCellSize(mesh, 0.01), solid.grid.size);
  // Pulled along x by 1 Pa: strain 1 along, -nu across.
  RowMatrix forces = RowMatrix::Zero(3 * static_cast<Index>(mesh.vertices.size()), 1);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d area = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]) / 2;
    for (const int n : {a, b, c}) forces(3 * n, 0) += area.x() / 3;
  }
  const MatrixXd found = solid.surface * displacementsUnder(solid, forces);
  const MatrixXd rigid = rigidMotions(mesh.vertices, Vector3d::Zero(), 3, 0.05);
  VectorXd expected(found.rows());
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
    expected.segment<3>(3 * static_cast<Index>(n)) = mesh.vertices[n].cwiseProduct(Vector3d(1, -poisson, -poisson));
  const VectorXd off = found.col(0) - expected;
  const VectorXd deformation = off - rigid * solvePositive(rigid.transpose() * rigid, rigid.transpose() * off);
  // Largest where the surface lies in a dropped cell.
  EXPECT_LT(deformation.cwiseAbs().maxCoeff(), 0.075 * 0.05);
}

// Timoshenko's beam without Poisson's ratio, which leaves the clamped end free to be plane: F L^3 / 3 E I + F L / k G
// A.
TEST(VoxelSolid, ACantileverBendsAsABeam) {
  const int sides = 18;
  const double length = 0.1, radius = 0.01, turn = 2 * std::numbers::pi / sides;
  const TriangleMesh mesh = cylinder();
  const double area = sides / 2. * radius * radius * std::sin(turn);
  const double moment = sides / 24. * std::pow(radius, 4) * std::sin(turn) * (2 + std::cos(turn));
  const double expected = length * length * length / (3 * moment) + length / (6. / 7 * 0.5 * area);
  const std::vector<int> held = trianglesWhere(mesh, [](const Vector3d& x) { return x.x() < 1e-6; });
  const NodeSurface surface = measureNodes(mesh, {});
  std::vector<double> errors;
  for (const double size : {0.01, 0.005}) {
    const VoxelSolid solid = makeVoxelSolid(mesh, size, {0, held, {}});
    RowMatrix forces = RowMatrix::Zero(3 * static_cast<Index>(mesh.vertices.size()), 1);
    double total = 0;
    for (const int t : trianglesWhere(mesh, [&](const Vector3d& x) { return x.x() > length - 1e-6; })) {
      const auto& [a, b, c] = mesh.triangles[t];
      const double part = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm() / 6;
      for (const int n : {a, b, c}) {
        forces(3 * n + 1, 0) += part;
        total += part;
      }
    }
    forces /= total;
    const MatrixXd found = solid.surface * displacementsUnder(solid, forces);
    const auto tip = static_cast<Index>(mesh.vertices.size()) - 1;
    errors.push_back(std::abs(found(3 * tip + 1, 0) / expected - 1));
  }
  // Forces spread from nodes move the end's load inward by a part of a triangle.
  EXPECT_LT(errors[0], 0.025);
  EXPECT_LT(errors[1], 0.025);
}

// A run holds nodes: what lies between nodes of two regions is held as if one spanned both.
TEST(HeldRegion, TrianglesBetweenRegionsAreHeld) {
  const TriangleMesh mesh = cylinder();
  const auto region = [&](const std::string& text, double from, double to) {
    HeldRegion out{text, {}, false};
    for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
      if (mesh.vertices[n].x() >= from && mesh.vertices[n].x() < to) out.nodes.push_back(static_cast<int>(n));
    return out;
  };
  const std::vector<int> whole = heldTriangles(mesh, {region("whole", -1, 0.0301)})[0];
  std::vector<int> parts;
  for (const std::vector<int>& of : heldTriangles(mesh, {region("near", -1, 0.0151), region("far", 0.0151, 0.0301)}))
    parts.insert(parts.end(), of.begin(), of.end());
  std::sort(parts.begin(), parts.end());
  EXPECT_EQ(parts, whole);
  const auto refusalOf = [&](const std::vector<HeldRegion>& regions) {
    return complaintOf([&] { heldTriangles(mesh, regions); });
  };
  EXPECT_EQ(refusalOf({region("all", -1, 1)}), "all holds the whole surface");
  EXPECT_EQ(refusalOf({region("half", -1, 0.05), region("rest", 0.05, 1)}), "half and others hold the whole surface");
}

// What lies behind the fan over the held triangles' rim is gone: the rest answers as a body that ends there.
TEST(VoxelSolid, MaterialBehindHeldTrianglesHoldsAsAFaceThereWould) {
  const TriangleMesh whole = cylinder();
  TriangleMesh rest = cylinderMesh(0.08, 0.01, 18, 16);
  for (Vector3d& x : rest.vertices) x.x() += 0.02;
  const std::vector<int> held = trianglesWhere(whole, [](const Vector3d& x) { return x.x() < 0.0201; });
  const std::vector<HeldSpace> spaces = heldSpaces(whole, {{"plane=1,0,0,0.0201", {}, true}}, {held});
  ASSERT_EQ(spaces.size(), 1u);
  const auto behind = behindHeld(spaces);
  EXPECT_TRUE(behind({0.019, 0.001, 0.002}));
  EXPECT_FALSE(behind({0.021, 0.001, 0.002}));
  const auto tipOf = [](const TriangleMesh& mesh, const SolidSettings& settings) {
    const VoxelSolid solid = makeVoxelSolid(mesh, 0.005, settings);
    const auto count = static_cast<Index>(mesh.vertices.size());
    RowMatrix forces = RowMatrix::Zero(3 * count, 1);
    for (Index n = 0; n < count; ++n) forces(3 * n + 1, 0) = mesh.vertices[n].x() > 0.0999 ? 1 : 0;
    return (solid.surface * displacementsUnder(solid, forces)).cwiseAbs().maxCoeff();
  };
  const std::vector<int> face = trianglesWhere(rest, [](const Vector3d& x) { return x.x() < 0.0201; });
  const double expected = tipOf(rest, {0.45, face, {}});
  EXPECT_NEAR(tipOf(whole, {0.45, held, spaces}) / expected, 1, 0.01);
  // A second region within the first holds nothing more.
  const std::vector<int> within = trianglesWhere(whole, [](const Vector3d& x) { return x.x() < 0.0101; });
  const std::vector<HeldSpace> both =
      heldSpaces(whole, {{"plane=1,0,0,0.0201", {}, true}, {"plane=1,0,0,0.0101", {}, true}}, {held, within});
  ASSERT_EQ(both.size(), 2u);
  EXPECT_NEAR(tipOf(whole, {0.45, held, both}) / tipOf(whole, {0.45, held, spaces}), 1, 1e-9);
}

// Held on a smooth surface, where cells converge slowest: with what held springs are found to give, cells little more
// than half as large change less than half as much, 0.6 instead of 1.4 %.
TEST(HeldGive, CellsOfTwoSizesAnswerAlike) {
  constexpr double size = 0.012, cut = -0.02;
  const TriangleMesh mesh = ellipsoidMesh(3, {0.05, 0.04, 0.03});
  SolidSettings settings;
  settings.heldTriangles = trianglesWhere(mesh, [](const Vector3d& x) { return x.x() < cut; });
  VoxelSolid solid = makeVoxelSolid(mesh, size, settings), fine = makeVoxelSolid(mesh, 0.0067, settings);
  const double give = giveOfHeld(mesh, settings, solid, makeVoxelSolid(mesh, size * 4 / 3, settings));
  NodeSurface surface = measureNodes(mesh, {});
  for (std::size_t n = 0; n < surface.held.size(); ++n) surface.held[n] = mesh.vertices[n].x() < cut;
  const RowMatrix forces = randomLoads(mesh, surface, LoadKind::bulk, 0.05, 16, 9);
  const auto change = [&] {
    return errorOf(solid.surface * displacementsUnder(solid, forces), fine.surface * displacementsUnder(fine, forces))
        .rms;
  };
  const double before = change();
  solid.give = fine.give = give;
  EXPECT_LT(change(), 0.5 * before);
  EXPECT_EQ(giveOfHeld(mesh, {}, makeVoxelSolid(mesh, 0.014, {}), solid), 0) << "nothing is held";
}

// A bar's end, the same bar held behind a plane and by its side, and half of a ball's surface. Facets of the bar lean
// by two degrees.
TEST(HeldRim, AnglesAreTheBodys) {
  const auto angles = [](const TriangleMesh& mesh, const std::vector<int>& held, const std::vector<HeldSpace>& spaces) {
    std::vector<double> out;
    for (const RimEdge& edge : rimOfHeld(mesh, held, spaces)) out.push_back(edge.angle);
    EXPECT_FALSE(out.empty());
    return out;
  };
  const TriangleMesh bar = cylinder();
  const std::vector<int> end = trianglesWhere(bar, [](const Vector3d& x) { return x.x() < 1e-6; });
  const std::vector<int> behind = trianglesWhere(bar, [](const Vector3d& x) { return x.x() < 0.0201; });
  const double right = std::numbers::pi / 2, straight = std::numbers::pi;
  for (const double angle : angles(bar, end, {})) EXPECT_NEAR(angle, right, 0.05);
  const std::vector<HeldSpace> spaces = heldSpaces(bar, {{"plane=1,0,0,0.0201", {}, true}}, {behind});
  for (const double angle : angles(bar, behind, spaces)) EXPECT_NEAR(angle, right, 0.05);
  for (const double angle : angles(bar, behind, {})) EXPECT_NEAR(angle, straight, 0.07);
  const TriangleMesh ball = ellipsoidMesh(3, {0.05, 0.05, 0.05});
  for (const double angle : angles(ball, trianglesWhere(ball, [](const Vector3d& x) { return x.x() < 0; }), {}))
    EXPECT_NEAR(angle, straight, 0.3);
  // Turned inside out a mesh is a cavity, whose corners are reflex.
  const TriangleMesh cavity = hollowed({}, bar);
  for (const double angle : angles(cavity, end, {})) EXPECT_NEAR(angle, 2 * straight - right, 0.05);
  EXPECT_NEAR(usualGive(rimOfHeld(bar, end, {})), usualGive(right), 0.05);
  EXPECT_LT(usualGive(right), usualGive(straight));
  EXPECT_EQ(usualGive(0.), 0);
  EXPECT_EQ(usualGive(std::vector<RimEdge>()), 0);
}

TEST(Multifrontal, SolvesAsAnySparseCholesky) {
  const TriangleMesh mesh = ellipsoidMesh(3, {0.05, 0.04, 0.03});
  const HexGrid grid = makeHexGrid(voxelsOf(mesh, 0.014));
  const DissectionPlan plan = planDissection(grid);
  const MatrixXd perPoint = stiffnessPerPoint(0.4);
  const auto stiffness = [&](std::span<const int> cells) {
    MatrixXd out = hexStiffness(grid, perPoint, cells);
    for (int k = 0; k < kHexFreedoms; ++k) out.row(k * (kHexFreedoms + 1)).array() += 1e-3 * grid.size;
    return out;
  };
  const Index n = 3 * static_cast<Index>(grid.nodes.size());
  std::vector<Eigen::Triplet<double>> entries;
  for (int c = 0; c < static_cast<int>(grid.cells.size()); ++c) {
    const MatrixXd k = stiffness(std::array{c}).reshaped(kHexFreedoms, kHexFreedoms);
    for (int i = 0; i < kHexFreedoms; ++i) {
      for (int j = 0; j < kHexFreedoms; ++j)
        entries.emplace_back(3 * grid.cellNodes[c][i / 3] + i % 3, 3 * grid.cellNodes[c][j / 3] + j % 3, k(i, j));
    }
  }
  Eigen::SparseMatrix<double> whole(n, n);
  whole.setFromTriplets(entries.begin(), entries.end());
  RowMatrix x = RowMatrix::Zero(n, 2);
  for (Index i = 0; i < n; ++i) x.row(i) << std::sin(i), std::cos(3 * i);
  const MatrixXd expected = Eigen::SimplicialLLT<Eigen::SparseMatrix<double>>(whole).solve(MatrixXd(x));
  solve(plan, factorise(plan, grid, stiffness), x);
  EXPECT_LT((x - expected).norm(), 1e-9 * expected.norm());
  EXPECT_GT(plan.fronts.size(), 5u);
}

TEST(Lbfgs, FindsTheEndOfACurvedValley) {  // Rosenbrock 1960
  VectorXd x = Eigen::Vector2d(-1.2, 1);
  const double value = descend(
      [](const VectorXd& at, VectorXd& gradient) {
        const double a = 1 - at[0], b = at[1] - at[0] * at[0];
        gradient[0] = -2 * a - 400 * at[0] * b;
        gradient[1] = 200 * b;
        return a * a + 100 * b * b;
      },
      {200, 1e-15, 10}, x);
  EXPECT_LT(value, 1e-12);
  EXPECT_NEAR(x[0], 1, 1e-5);
  EXPECT_NEAR(x[1], 1, 1e-5);
}

TEST(Lbfgs, RefusesAStartOutsideTheDomain) {
  VectorXd x = VectorXd::Ones(2);
  EXPECT_THROW(descend([](const VectorXd&, VectorXd&) { return std::numeric_limits<double>::infinity(); }, {}, x),
               std::runtime_error);
}

TEST(CheckLoads, WhatIsNotFiniteIsNoErrorOfZero) {
  const MatrixXd expected = MatrixXd::Ones(3, 2);
  MatrixXd found = expected;
  found(1, 1) = std::nan("");
  EXPECT_THROW(errorOf(found, expected), std::runtime_error);
}

TEST(CheckLoads, LoadsThatMoveNothingDoNotCount) {
  MatrixXd expected = MatrixXd::Zero(3, 2), found = expected;
  expected(0, 0) = 2;
  found(0, 0) = 1;
  EXPECT_DOUBLE_EQ(errorOf(found, expected).rms, 50);
}

// One node of three off by a fifth of what its load moves, under one load of two.
TEST(CheckLoads, ErrorsAreRelativeToTheirOwnLoadsLargestDisplacement) {
  MatrixXd expected = MatrixXd::Zero(9, 2);
  expected.col(0) << 0, 0, 0, 3, 0, 4, 1, 0, 0;
  expected.col(1) << 0, 10, 0, 0, 0, 0, 2, 0, 0;
  MatrixXd found = expected;
  EXPECT_EQ(errorOf(found, expected).maximum, 0);
  EXPECT_EQ(errorOf(found, expected).rms, 0);
  found(8, 0) += 1;
  EXPECT_NEAR(errorOf(found, expected).maximum, 20, 1e-12);
  EXPECT_NEAR(errorOf(found, expected).rms, 100 * std::sqrt(0.04 / 3 / 2), 1e-12);
  found(8, 1) -= 3;
  EXPECT_NEAR(errorOf(found, expected).maximum, 30, 1e-12);
  EXPECT_NEAR(errorOf(found, expected).rms, 100 * std::sqrt((0.04 + 0.09) / 3 / 2), 1e-12);
}

TEST(CheckLoads, EveryLoadHasThreeFreeNodesHoweverFewAreFree) {
  const TriangleMesh mesh = cylinder();
  NodeSurface surface = measureNodes(mesh, {});
  for (std::size_t n = 3; n < surface.held.size(); ++n) surface.held[n] = true;
  for (const LoadKind kind : {LoadKind::bulk, LoadKind::poke}) {
    const RowMatrix forces = randomLoads(mesh, surface, kind, 1e-3, 8, 1);
    for (Index load = 0; load < forces.cols(); ++load) {
      for (Index n = 0; n < 3; ++n) EXPECT_GT((forces.block<3, 1>(3 * n, load).norm()), 0);
    }
    EXPECT_EQ(forces.bottomRows(forces.rows() - 9).norm(), 0);
  }
  surface.held[0] = true;
  EXPECT_THROW(randomLoads(mesh, surface, LoadKind::bulk, 1e-3, 8, 1), std::runtime_error);
}

TEST(IdentifiedNetwork, LinksAndSkinFollowRigidMotion) {
  for (const Identification* found : {&heldCylinder(), &freeCylinder()}) {
    const IdentifiedNetwork& n = found->network;
    std::vector<Vector3d> places;
    for (const IdentifiedFrame& f : n.frames) places.push_back(f.restPosition);
    for (const IdentifiedLink& link : n.links) {
      const MatrixXd rigid = rigidMotions({link.restPoint0, link.restPoint1}, {0.1, 0.2, 0.3}, 6, n.lengthScale);
      EXPECT_LT((linkMeasures(link, n.lengthScale) * rigid).norm(), 1e-12 * rigid.norm());
      EXPECT_GE(symmetricEigen(link.stiffness).values[0], -1e-12 * link.stiffness.norm());
    }
    const TriangleMesh mesh = cylinder();
    const MatrixXd expected = rigidMotions(mesh.vertices, {0, 0, 0}, 3, n.lengthScale);
    for (std::size_t node = 0; node < n.skin.size(); ++node) {
      MatrixXd moved = MatrixXd::Zero(3, 6);
      double weights = 0;
      for (const SkinFrame& f : n.skin[node]) {
        moved += f.map * rigidMotions({f.restPoint}, {0, 0, 0}, 6, n.lengthScale);
        weights += f.weight;
      }
      EXPECT_LT((moved - expected.middleRows<3>(3 * static_cast<Index>(node))).norm(), 1e-10);
      EXPECT_NEAR(weights, 1, 1e-12);
    }
  }
}

TEST(IdentifiedNetwork, AnswersLoadsAsFiniteElementsDo) {
  const IdentifiedNetwork& held = heldCylinder().network;
  EXPECT_LT(held.bulk.rms, 1.5);
  EXPECT_LT(held.poke.rms, 1.5);
  EXPECT_LT(held.ofFiniteElements.rms, 1);
  EXPECT_GT(held.bulk.rms, 0);
  EXPECT_LT(freeCylinder().network.bulk.rms, 3);
  EXPECT_LT(freeCylinder().network.ofFiniteElements.maximum, 5) << "pins carry nothing under balanced loads";
  ASSERT_EQ(held.patches.size(), 1u);
  EXPECT_EQ(held.patches[0].nodes.size(), 19u);
  for (const int n : held.patches[0].nodes) EXPECT_EQ(held.skin[n].front().frame, static_cast<int>(held.frames.size()));
}

// Frames behind a patch stand still in finite elements; held altogether they do not set the step.
TEST(IdentifiedNetwork, SpheresBehindAPatchAreHeld) {
  HeldRegion region{"plane=1,0,0,0.0451", {}, true};
  const TriangleMesh mesh = cylinder();
  for (std::size_t n = 0; n < mesh.vertices.size(); ++n)
    if (mesh.vertices[n].x() <= 0.0451) region.nodes.push_back(static_cast<int>(n));
  const IdentifiedNetwork network = identifyNetwork(cylinderModel(), {region}, {}).network;
  std::vector<int> behind;
  for (std::size_t k = 0; k < network.frames.size(); ++k)
    if (network.frames[k].restPosition.x() < 0.035) behind.push_back(static_cast<int>(k));
  ASSERT_GE(behind.size(), 1u);
  EXPECT_EQ(network.heldFrames, behind);
  EXPECT_TRUE(heldCylinder().network.heldFrames.empty());
  EXPECT_TRUE(freeCylinder().network.heldFrames.empty());
  // Two regions that overlap share the stiffness of what lies behind both; together they hold as much.
  HeldRegion beyond{"box=0.01,-1,-1,0.0451,1,1", {}, true}, before{"plane=1,0,0,0.0301", {}, true};
  for (const int n : region.nodes) {
    if (mesh.vertices[n].x() >= 0.01) beyond.nodes.push_back(n);
    if (mesh.vertices[n].x() <= 0.0301) before.nodes.push_back(n);
  }
  EXPECT_EQ(identifyNetwork(cylinderModel(), {before, beyond}, {}).network.heldFrames, behind);

  BodyDescription body;
  body.model = [&] {
    auto model = std::make_shared<SoftBodyModel>(cylinderModel());
    model->identified = std::make_shared<IdentifiedNetwork>(network);
    return model;
  }();
  body.links = LinkModel::identified;
  body.tissue = {.young = 5e3, .poisson = 0.45, .density = 1000};
  body.fixedNodes = network.patches[0].nodes;
  const double loose = World({}, {body}).substep();
  for (const int sphere : behind) body.fixed.push_back({sphere});
  EXPECT_GT(World({}, {body}).substep(), 2 * loose);
}

std::string refusal(const std::vector<HeldRegion>& regions, const IdentifySettings& settings) {
  return complaintOf([&] { identifyNetwork(cylinderModel(), regions, settings); });
}

TEST(IdentifiedNetwork, WhatCannotBeIsRefused) {
  IdentifySettings settings;
  for (const double poisson : {-0.1, 0.5, std::nan("")}) {
    settings.poisson = poisson;
    EXPECT_NE(refusal({}, settings).find("less than 0.5"), std::string::npos) << poisson;
  }
  EXPECT_EQ(refusal({{"box=1", {}, {}}}, {}), "box=1 holds no node of the surface");
  EXPECT_EQ(refusal({{"box=1", {0, 100}, {}}}, {}),
            "box=1 holds 2 nodes but no whole triangle of the surface; expected one at least");
  SoftBodyModel model = cylinderModel();
  model.spheres.resize(1);
  EXPECT_THROW(identifyNetwork(model, {}, {}), std::runtime_error);
  model.spheres.resize(301);
  EXPECT_THROW(identifyNetwork(model, {endOfCylinder(cylinder())}, {}), std::runtime_error);
  settings = {};
  settings.memoryMax = 2e7;
  EXPECT_NE(refusal({endOfCylinder(cylinder())}, settings).find("GB, expected at most 0.0 GB"), std::string::npos);
}

}  // namespace
}  // namespace medulla
