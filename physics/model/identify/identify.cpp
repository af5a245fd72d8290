#include "physics/model/identify/identify.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "physics/model/identify/layer_fit.h"
#include "physics/model/identify/skin_fit.h"

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Progress = std::function<void(double)>;

namespace {

void checkSettings(const IdentifySettings& s) {
  if (!(s.poisson >= 0 && s.poisson < 0.5))
    throw std::runtime_error(fmt::format("a Poisson's ratio of {}; expected 0 or more and less than 0.5", s.poisson));
}

double chosenSize(const CellFrames*, const SoftBodyModel& model) {
  double volume = 0;
  for (const FillingSphere& s : model.spheres) volume += s.volume;
  return std::cbrt(volume / static_cast<double>(model.spheres.size())) / 2.4;
}

// Solutions under unit loads on the frames, as their frames and the mesh's nodes see them.
struct Responses {
  MatrixXd frames, nodes;  // 6 frames and 3 nodes x 6 frames
};

Responses solveFrames(const VoxelSolid& solid, const CellFrames& cells, const Progress& progress) {
  constexpr Index block = 48;
  const Index n = cells.motion.rows();
  Responses out{MatrixXd(n, n), MatrixXd(solid.surface.rows(), n)};
  for (Index first = 0; first < n; first += block) {
    const Index count = std::min(block, n - first);
    RowMatrix x = RowMatrix(cells.motion.middleRows(first, count)).transpose();
    solve(solid.plan, solid.factors, x);
    out.frames.middleCols(first, count) = cells.motion * x;
    out.nodes.middleCols(first, count) = solid.surface * x;
    if (progress) progress(static_cast<double>(first + count) / static_cast<double>(n));
  }
  out.frames = (out.frames + out.frames.transpose()).eval() / 2;
  return out;
}

// What the network makes of forces on nodes: the frames' part and the layer's.
MatrixXd framesResponse(const IdentifiedNetwork& n, const RowMatrix& forces) {
  const int frames = static_cast<int>(n.frames.size());
  const RowSparse skin = skinMatrix(n.skin, frames);
  const MatrixXd loads = skin.transpose() * forces;
  return skin * MatrixXd(networkStiffness(n.links, n.lengthScale, frames).llt().solve(loads));
}

VectorXd largestOf(const MatrixXd& displacements) {
  VectorXd out = VectorXd::Zero(displacements.cols());
  for (Index load = 0; load < out.size(); ++load) {
    for (Index n = 0; 3 * n < displacements.rows(); ++n)
      out[load] = std::max(out[load], displacements.block<3, 1>(3 * n, load).norm());
  }
  return out;
}

// Fits the layer to loads of its own, and measures the network on others and on bulk loads, which nothing was fitted
// to; then solves those again in cells a third larger.
void fitLayerAndMeasure(const TriangleMesh& mesh, const VoxelSolid& solid, const SolidSettings& settings,
                        IdentifiedNetwork& out, const Progress& progress) {
  constexpr int fitted = 16, checked = 16;
  const NodeSurface surface = measureNodes(mesh, out.patches);
  const auto exact = [&](const VoxelSolid& s, const RowMatrix& forces) -> MatrixXd {
    return s.surface * displacementsUnder(s, forces);
  };
  RowMatrix teaching(3 * static_cast<Index>(mesh.vertices.size()), 2 * fitted);
  teaching << randomLoads(mesh, surface, LoadKind::bulk, out.lengthScale, fitted, 1),
      randomLoads(mesh, surface, LoadKind::poke, out.lengthScale, fitted, 1);
  const MatrixXd under = exact(solid, teaching);
  out.layer =
      fitLayer(mesh, surface, teaching, under - framesResponse(out, teaching), largestOf(under), out.lengthScale);
  progress(0.4);
  SolidSettings coarse = settings;
  const VoxelSolid other = makeVoxelSolid(mesh, 4. / 3 * solid.grid.size, coarse);
  progress(0.8);
  IdentifiedError ofGrids;
  for (const LoadKind kind : {LoadKind::bulk, LoadKind::poke}) {
    const RowMatrix forces = randomLoads(mesh, surface, kind, out.lengthScale, checked, 2);
    const MatrixXd expected = exact(solid, forces);
    const MatrixXd found = framesResponse(out, forces) + layerResponse(mesh, surface, out.layer, forces);
    (kind == LoadKind::bulk ? out.bulk : out.poke) = errorOf(found, expected);
    const IdentifiedError grids = errorOf(exact(other, forces), expected);
    ofGrids = {std::max(ofGrids.maximum, grids.maximum), std::max(ofGrids.rms, grids.rms)};
  }
  out.ofFiniteElements = ofGrids;
  progress(1);
}

}  // namespace

IdentifiedNetwork identifyNetwork(const SoftBodyModel& model, const std::vector<HeldRegion>& held,
                                  const IdentifySettings& settings, const Progress& progress) {
  checkSettings(settings);
  const TriangleMesh mesh{model.restNodes, model.triangles};
  IdentifiedNetwork out;
  out.poisson = settings.poisson;
  SolidSettings solidSettings{settings.poisson, {}, {}, settings.memoryMax};
  std::vector<std::vector<int>> patchTriangles;
  for (const HeldRegion& region : held) {
    patchTriangles.push_back(wholeTriangles(mesh, region));
    out.patches.push_back({region.text, region.nodes});
    solidSettings.heldTriangles.insert(solidSettings.heldTriangles.end(), patchTriangles.back().begin(),
                                       patchTriangles.back().end());
  }
  solidSettings.heldSpace = heldMaterial(mesh, held, patchTriangles);
  const auto stage = [&](double from, double to) -> Progress {
    return [&progress, from, to](double part) {
      if (progress) progress(std::lerp(from, to, part));
    };
  };
  std::vector<Ball> balls;
  for (const FillingSphere& s : model.spheres) balls.push_back({s.restBallCentre, s.radius});
  const VoxelSolid solid = makeVoxelSolid(mesh, settings.cellSize > 0 ? settings.cellSize : chosenSize(nullptr, model),
                                          solidSettings, stage(0, 0.2));
  CellFrames cells = makeCellFrames(mesh, balls, solid);
  const Responses responses = solveFrames(solid, cells, stage(0.2, 0.4));
  out.voxel = solid.grid.size;
  out.lengthScale = cells.lengthScale;
  out.links = layOutLinks(mesh, cells, out.patches, patchTriangles);
  fitLinks(responses.frames, {}, out.lengthScale, settings.links, out.links, stage(0.4, 0.85));
  out.skin = fitSkin(mesh, cells, out.patches, responses.frames, responses.nodes);
  out.frames = std::move(cells.frames);
  fitLayerAndMeasure(mesh, solid, solidSettings, out, stage(0.85, 1));
  return out;
}

}  // namespace medulla
