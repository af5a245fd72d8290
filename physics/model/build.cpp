#include "physics/model/build.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "physics/content_hash.h"
#include "physics/model/attachment.h"
#include "physics/model/ball_choice.h"
#include "physics/model/build_report.h"
#include "physics/model/edge_collapse_skeleton.h"
#include "physics/model/link_ends.h"
#include "physics/model/link_graph.h"
#include "physics/model/link_sections.h"
#include "physics/model/mass_properties.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/node_volumes.h"
#include "physics/model/power_cells.h"
#include "physics/model/render_surface.h"
#include "physics/sort_unique.h"

namespace medulla {

using Eigen::Vector3d;
using Progress = std::function<void(double)>;

namespace {

struct SpheresAndLinks {
  std::vector<Ball> balls;
  PowerCells cells;
  SphereLinks links;
};

void checkSettings(const BuildSettings& s) {
  if (s.spheres < 1 || s.spheres > kSpheresMax)
    throw std::runtime_error(fmt::format("{} spheres asked for; expected 1 to {}", s.spheres, kSpheresMax));
  if (!(s.gap >= 0 && s.gap < 100))
    throw std::runtime_error(fmt::format("a gap of {} % asked for; expected more than 0 and less than 100", s.gap));
  if (s.overshoot && !(*s.overshoot >= 0 && *s.overshoot <= 5))
    throw std::runtime_error(fmt::format("an overshoot of {} % asked for; expected 0 to 5", *s.overshoot));
  if (!(s.surfaceMassFraction >= 0 && s.surfaceMassFraction <= 0.4))
    throw std::runtime_error(fmt::format("surface mass fraction {}; expected 0 to 0.4", s.surfaceMassFraction));
  if (s.renderLevels < 0 || s.renderLevels > 4)
    throw std::runtime_error(fmt::format("{} render levels; expected 0 to 4", s.renderLevels));
}

void requireDrawable(std::size_t triangles, int levels) {
  constexpr std::size_t kMost = 4'000'000;  // 3 GB while they are made
  if (triangles << (2 * levels) > kMost)
    throw std::runtime_error(fmt::format("{} triangles, divided {} times, are {} to draw; expected {} at most",
                                         triangles, levels, triangles << (2 * levels), kMost));
}

bool isEmpty(const MassProperties& cell) {
  return cell.volume <= 0;
}

// Spheres without material of their own are dropped; links to them pass to the nearest other sphere.
void dropEmptyCells(const VoxelBody& voxels, const MassProperties& exact, SpheresAndLinks& s) {
  for (;;) {
    const auto empty = std::find_if(s.cells.cells.begin(), s.cells.cells.end(), isEmpty);
    if (empty == s.cells.cells.end()) return;
    if (s.balls.size() == 1) throw std::runtime_error("the mesh is too thin for a single sphere");
    const int gone = static_cast<int>(empty - s.cells.cells.begin());
    int heir = gone == 0 ? 1 : 0;
    for (int k = 0; k < static_cast<int>(s.balls.size()); ++k) {
      const auto distance = [&](int i) { return (s.balls[i].centre - s.balls[gone].centre).norm(); };
      if (k != gone && distance(k) < distance(heir)) heir = k;
    }
    for (std::array<int, 2>& link : s.links) {
      for (int& end : link) {
        end = end == gone ? heir : end;
        end -= end > gone ? 1 : 0;
      }
      if (link[0] > link[1]) std::swap(link[0], link[1]);
    }
    sortUnique(s.links);
    std::erase_if(s.links, [](const std::array<int, 2>& l) { return l[0] == l[1]; });
    s.balls.erase(s.balls.begin() + gone);
    s.cells = divideByPower(voxels, s.balls, exact);
  }
}

// Columns are whole or empty along x and y, and a fin that stands between them has no voxel: where a cell stays empty
// even voxels are asked, which are many times the work. Returns the voxels that were.
VoxelBody fillCells(const BodyShape& shape, SpheresAndLinks& s) {
  const int target = voxelsFor(static_cast<int>(s.balls.size()));
  const auto divide = [&](const VoxelBody& voxels) { s.cells = divideByPower(voxels, s.balls, shape.exact); };
  VoxelBody voxels = voxelise(shape.mesh, shape.exact.volume, target);
  divide(voxels);
  if (std::none_of(s.cells.cells.begin(), s.cells.cells.end(), isEmpty)) return voxels;
  voxels = voxeliseEvenly(shape.mesh, shape.exact.volume, target);
  divide(voxels);
  dropEmptyCells(voxels, shape.exact, s);
  return voxels;
}

// The paper's raw result: skeleton nodes are spheres of inscribed radius, skeleton edges are links.
SpheresAndLinks spheresOfSkeleton(const BodyShape& shape, const Skeleton& skeleton) {
  SpheresAndLinks s;
  for (const Vector3d& node : skeleton.nodes) {
    s.balls.push_back({node, inscribedRadius(shape.tree, node)});
    if (!(s.balls.back().radius > 0))
      throw std::runtime_error(
          fmt::format("the collapsed skeleton has a node outside of the surface, at ({:.3g}, {:.3g}, "
                      "{:.3g}) m: no sphere fits there; use --method cover",
                      node.x(), node.y(), node.z()));
  }
  for (const std::array<int, 2>& link : skeleton.links) s.links.push_back({link[0], link[1]});
  fillCells(shape, s);
  joinComponents(s.balls, s.links);
  std::sort(s.links.begin(), s.links.end());
  return s;
}

SpheresAndLinks spheresByCover(const BodyShape& shape, std::vector<Ball> balls) {
  SpheresAndLinks s;
  s.balls = std::move(balls);
  const VoxelBody voxels = fillCells(shape, s);
  s.links = linkCells(shape.tree, s.cells.cells, contactAreasWithin(shape.tree, voxels, s.cells.cellOfPiece), s.balls);
  return s;
}

// Where nodes hang depends on the frames, and the frames on the mass that hangs. Some rounds choose what every node
// hangs on, the others only slide along: choosing to the end can swing between two hosts for ever.
void hangNodesAndShareMass(const BodyShape& shape, const SpheresAndLinks& s, double massFraction,
                           SoftBodyModel& model) {
  constexpr int choosingRounds = 3, slidingRounds = 8;
  for (std::size_t i = 0; i < s.balls.size(); ++i) {
    const MassProperties& cell = s.cells.cells[i];
    model.spheres.push_back(
        {s.balls[i].centre, s.balls[i].radius, cell.centroid, cell.centroid, cell.volume, cell.secondMoment});
  }
  for (const std::array<int, 2>& pair : s.links) {
    model.links.emplace_back();
    model.links.back().sphere0 = pair[0];
    model.links.back().sphere1 = pair[1];
  }
  placeLinkEnds(shape.mesh, shape.tree, s.cells.sites, model.links, model.spheres);
  for (int round = 0; round < choosingRounds + slidingRounds; ++round) {
    if (round < choosingRounds)
      model.attachments = attachNodes(shape.mesh, shape.tree, model.spheres, model.links);
    else
      reprojectAttachments(shape.mesh, model.spheres, model.links, model.attachments);
    shareOutMass(shape.mesh, s.cells, massFraction, model.attachments, model.spheres);
    placeLinkEnds(shape.mesh, shape.tree, s.cells.sites, model.links, model.spheres);
  }
  reprojectAttachments(shape.mesh, model.spheres, model.links, model.attachments);
}

}  // namespace

std::uint64_t hashMesh(const TriangleMesh& mesh) {
  NumberHash hash;
  for (const Vector3d& v : mesh.vertices)
    for (int a = 0; a < 3; ++a) hash.add(v[a]);
  for (const std::array<int, 3>& t : mesh.triangles)
    for (const int corner : t) hash.add(static_cast<std::uint64_t>(corner));
  return hash.value();
}

double overshootOf(const BuildSettings& s) {
  if (s.overshoot) return *s.overshoot;
  return s.gap > 0 ? std::min(s.gap / 2, 5.0) : 4.2 / std::sqrt(s.spheres);
}

std::string describeSettings(const BuildSettings& s) {
  if (s.method == BuildMethod::skeleton)
    return fmt::format("--method skeleton --surface-mass {} --render-levels {}", s.surfaceMassFraction, s.renderLevels);
  const std::string resolution = s.gap > 0 ? fmt::format("--gap {}", s.gap) : fmt::format("--spheres {}", s.spheres);
  return fmt::format("--method cover {} --overshoot {} --surface-mass {} --render-levels {}", resolution,
                     overshootOf(s), s.surfaceMassFraction, s.renderLevels);
}

SoftBodyModel buildModel(const RepairedMesh& repaired, const TriangleMesh* fine, const BuildSettings& settings,
                         BuildReport& report, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  checkSettings(settings);
  requireDrawable(repaired.mesh.triangles.size(), settings.renderLevels);
  const BodyShape shape = measureShape(repaired.mesh, overshootOf(settings));

  SoftBodyModel model;
  model.meshHash = hashMesh(repaired.mesh);
  model.settings = describeSettings(settings);
  model.nodeOfInputVertex = repaired.vertexOfInput;
  model.restNodes = shape.mesh.vertices;
  model.triangles = shape.mesh.triangles;
  model.edges = uniqueEdges(shape.mesh);
  model.skeleton = collapseEdges(shape.mesh);
  progress(0.05);

  SpheresAndLinks s;
  const auto choosing = [&](double part) { progress(std::lerp(0.05, 0.7, part)); };
  if (settings.method == BuildMethod::skeleton)
    s = spheresOfSkeleton(shape, model.skeleton);
  else if (settings.gap > 0)
    s = spheresByCover(shape, fewestBalls(shape, settings.gap, kSpheresMax, choosing));
  else
    s = spheresByCover(shape, chooseBalls(shape, settings.spheres, CoverGoal::gapAndVolume, choosing));
  progress(0.7);
  hangNodesAndShareMass(shape, s, settings.surfaceMassFraction, model);
  measureLinks(shape.mesh, s.cells.sites, model.spheres, model.links);
  model.buckets = fillBuckets(model.triangles, model.attachments, static_cast<int>(model.spheres.size()), model.links);
  progress(0.8);
  model.renderSurface = makeRenderSurface(shape.mesh, settings.renderLevels, fine);
  progress(0.9);
  report = measureModel(model);
  report.hollowLinks = countHollowLinks(shape.mesh, shape.tree, s.cells.sites, model.spheres, model.links);
  report.longEdges = longEdges(shape.mesh, shape.tree);
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  progress(1);
  return model;
}

}  // namespace medulla
