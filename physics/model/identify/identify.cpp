#include "physics/model/identify/identify.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "physics/model/identify/skin_fit.h"
#include "physics/model/surface_queries.h"

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Progress = std::function<void(double)>;

namespace {

void checkSettings(const IdentifySettings& s) {
  if (!(s.poisson >= 0 && s.poisson < 0.5))
    throw std::runtime_error(fmt::format("a Poisson's ratio of {}; expected 0 or more and less than 0.5", s.poisson));
}

std::vector<int> wholeTriangles(const TriangleMesh& mesh, const HeldRegion& region) {
  if (region.nodes.empty()) throw std::runtime_error(fmt::format("{} holds no node of the surface", region.text));
  std::vector<bool> held(mesh.vertices.size(), false);
  for (const int n : region.nodes) held[n] = true;
  std::vector<int> out;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (held[a] && held[b] && held[c]) out.push_back(static_cast<int>(t));
  }
  if (out.empty()) {
    throw std::runtime_error(
        fmt::format("{} holds {} nodes but no whole triangle of the surface; expected one at least", region.text,
                    region.nodes.size()));
  }
  return out;
}

// The material in a region that is nearer to the triangles held there than to all others: what lies behind them, where
// a region ends within a triangle, too.
std::function<bool(const Vector3d&)> heldSpaceOf(const TriangleMesh& mesh, const std::vector<HeldRegion>& regions,
                                                 const std::vector<std::vector<int>>& patchTriangles) {
  struct Space {
    std::function<bool(const Vector3d&)> contains;
    SurfaceTree held, others;
  };
  const auto spaces = std::make_shared<std::vector<Space>>();
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (!regions[r].contains) continue;
    TriangleMesh held{mesh.vertices, {}}, others{mesh.vertices, {}};
    for (std::size_t t = 0, next = 0; t < mesh.triangles.size(); ++t) {
      const bool isHeld = next < patchTriangles[r].size() && patchTriangles[r][next] == static_cast<int>(t);
      (isHeld ? held : others).triangles.push_back(mesh.triangles[t]);
      next += isHeld ? 1 : 0;
    }
    if (others.triangles.empty()) throw std::runtime_error(regions[r].text + " holds the whole surface");
    spaces->push_back({regions[r].contains, makeSurfaceTree(held), makeSurfaceTree(others)});
  }
  if (spaces->empty()) return {};
  return [spaces](const Vector3d& x) {
    return std::any_of(spaces->begin(), spaces->end(), [&](const Space& s) {
      return s.contains(x) && closestPoint(s.held, x).distance < closestPoint(s.others, x).distance;
    });
  };
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
  solidSettings.heldSpace = heldSpaceOf(mesh, held, patchTriangles);
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
  fitLinks(responses.frames, {}, out.lengthScale, settings.links, out.links, stage(0.4, 0.9));
  out.skin = fitSkin(mesh, cells, out.patches, responses.frames, responses.nodes);
  out.frames = std::move(cells.frames);
  out.layer = {1 / (0.3 * out.lengthScale), 1 / (0.5 * out.lengthScale), 0.01 * out.lengthScale};
  if (progress) progress(1);
  return out;
}

}  // namespace medulla
