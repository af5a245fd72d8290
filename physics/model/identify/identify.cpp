#include "physics/model/identify/identify.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "physics/model/identify/end_loads.h"
#include "physics/model/identify/held_give.h"
#include "physics/model/identify/layer_fit.h"
#include "physics/model/identify/necks.h"
#include "physics/model/identify/parallel.h"
#include "physics/model/identify/reduction.h"
#include "physics/model/identify/skin_fit.h"
#include "physics/model/identify/thin_parts.h"
#include "physics/model/row_of_cells.h"
#include "physics/sort_unique.h"

namespace medulla {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Progress = std::function<void(double)>;

namespace {

constexpr double kLargerCells = 4. / 3;  // times the size: the grid that tells how far the finite elements are off

void checkSettings(const IdentifySettings& s) {
  if (!(s.poisson >= 0 && s.poisson < 0.5))
    throw std::runtime_error(fmt::format("a Poisson's ratio of {}; expected 0 or more and less than 0.5", s.poisson));
}

void checkModel(const SoftBodyModel& model, bool held) {
  if (model.spheres.size() > kIdentifiedSpheresMax)
    throw std::runtime_error(
        fmt::format("{} spheres are too many to identify: the time grows with their cube; expected at most {}",
                    model.spheres.size(), kIdentifiedSpheresMax));
  if (model.spheres.size() < 2 && !held)
    throw std::runtime_error(
        "a single sphere that nothing holds has nothing to identify; expected --fix or more spheres");
}

// Anything that is not a number would reach the model file.
void requireFinite(const IdentifiedNetwork& n) {
  bool finite = true;
  const auto check = [&](const auto& m) { finite = finite && m.allFinite(); };
  for (const IdentifiedFrame& f : n.frames) {
    check(f.restPosition);
    check(f.secondMoment);
    check(Vector3d::Constant(f.volume));
  }
  for (const IdentifiedLink& link : n.links) {
    check(link.restPoint1);
    check(link.axes);
    check(link.stiffness);
    check(link.strain0);
    check(link.strain1);
  }
  for (const std::vector<SkinFrame>& node : n.skin) {
    for (const SkinFrame& f : node) {
      check(f.map);
      check(Vector3d::Constant(f.weight));
    }
  }
  check(Vector3d(n.layer.normal, n.layer.tangential, n.layer.membrane));
  for (const IdentifiedError& e : {n.bulk, n.poke, n.ofFiniteElements}) check(Vector3d(e.maximum, e.rms, 0));
  if (!finite) throw std::runtime_error("the identified network has numbers that are not finite");
}

struct CellSize {
  double size = 0;   // m
  std::string neck;  // where the mesh asks for it; empty where the spheres do
};

// Volume (m3) on the smaller side of each link where it alone joins two parts of the body, 0 where others join them
// too.
std::vector<double> volumesBehind(const SoftBodyModel& model) {
  std::vector<double> out;
  double total = 0;
  for (const FillingSphere& s : model.spheres) total += s.volume;
  for (std::size_t cut = 0; cut < model.links.size(); ++cut) {
    std::vector<bool> reached(model.spheres.size(), false);
    reached[model.links[cut].sphere0] = true;
    for (bool more = true; more;) {
      more = false;
      for (std::size_t l = 0; l < model.links.size(); ++l) {
        const int a = model.links[l].sphere0, b = model.links[l].sphere1;
        if (l == cut || reached[a] == reached[b]) continue;
        reached[a] = reached[b] = more = true;
      }
    }
    double volume = 0;
    for (std::size_t i = 0; i < reached.size(); ++i) volume += reached[i] ? model.spheres[i].volume : 0;
    out.push_back(reached[model.links[cut].sphere1] ? 0 : std::min(volume, total - volume));
  }
  return out;
}

// Of the links' sections, which may miss what several links pass, or pass aslant.
CellSize orNarrower(const CellSize& found, const TriangleMesh& mesh, double widest, double perNeck, double leastPart,
                    const std::function<bool(const Vector3d&)>& behind) {
  constexpr double kMuch = 0.9;
  const std::optional<Neck> neck = narrowestNeck(mesh, widest, leastPart);
  if (!neck || neck->width / perNeck >= kMuch * found.size || behind(neck->place)) return found;
  return {neck->width / perNeck,
          fmt::format("the neck of {:.2g} mm near {} m", 1e3 * neck->width, placeText(neck->place))};
}

// Cells of the spheres span three cells of the grid or more, necks between parts of the body two; 1500 for the whole
// body take four seconds of two processors at seven spheres. Where what is held ends, displacements go as the root of
// the distance, which no polynomial follows, so that finer cells converge in the first order only: at 600 a gallbladder
// held by its neck bends half a percent less.
CellSize chooseSize(const SoftBodyModel& model, const TriangleMesh& mesh,
                    const std::function<bool(const Vector3d&)>& behind) {
  constexpr double perSphere = 3, perNeck = 2, perBody = 1500;
  constexpr double partMin = 0.02;  // of the body: what hangs on a thinner neck moves with it alone
  double volume = 0;
  for (const FillingSphere& s : model.spheres) volume += s.volume;
  const double spheres = std::cbrt(volume / static_cast<double>(model.spheres.size())) / perSphere;
  const double ofBody = std::min(spheres, std::cbrt(volume / perBody));
  CellSize out{ofBody, ""};
  const std::vector<double> beyond = volumesBehind(model);
  for (std::size_t l = 0; l < model.links.size(); ++l) {
    if (beyond[l] < partMin * volume) continue;
    const ElasticLink& link = model.links[l];
    const Vector3d from = model.spheres[link.sphere0].restLinkEnd, to = model.spheres[link.sphere1].restLinkEnd;
    // The outer sections of a link may lie in the body's rounded end.
    for (int k = 2; k + 2 < ElasticLink::kSections; ++k) {
      const double neck = 2 * std::sqrt(link.sections[k].area / std::numbers::pi);
      const Vector3d place = from + (k + 0.5) / ElasticLink::kSections * (to - from);
      if (neck / perNeck >= out.size || behind(place)) continue;
      out = {neck / perNeck, fmt::format("the neck of {:.2g} mm between spheres {} and {}, near {} m", 1e3 * neck,
                                         link.sphere0, link.sphere1, placeText(place))};
    }
  }
  return orNarrower(out, mesh, perNeck * ofBody, perNeck, partMin, behind);
}

VoxelSolid makeSolid(const SoftBodyModel& model, const TriangleMesh& mesh, const CellSize& cell,
                     const SolidSettings& solid, const Progress& progress) {
  try {
    return makeVoxelSolid(mesh, cell.size, solid, progress);
  } catch (const OverBudget& error) {
    const std::string why = cell.neck.empty()
                                ? fmt::format("fewer spheres than {} would do with larger ones", model.spheres.size())
                                : "it is too thin for its size: " + cell.neck;
    throw std::runtime_error(fmt::format("{}; {}", error.what(), why));
  }
}

// What the network makes of forces on nodes, without the layer.
MatrixXd framesResponse(const IdentifiedNetwork& n, const MatrixXd& grounding, const RowMatrix& forces) {
  const int frames = static_cast<int>(n.frames.size());
  const RowSparse skin = skinMatrix(n.skin, frames);
  const MatrixXd loads = skin.transpose() * forces;
  MatrixXd stiffness = networkStiffness(n.links, n.lengthScale, frames);
  if (grounding.size() > 0) stiffness += grounding;
  return skin * solvePositive(stiffness, loads);
}

VectorXd largestOf(const MatrixXd& displacements) {
  VectorXd out = VectorXd::Zero(displacements.cols());
  for (Index load = 0; load < out.size(); ++load)
    for (Index n = 0; 3 * n < displacements.rows(); ++n)
      out[load] = std::max(out[load], displacements.block<3, 1>(3 * n, load).norm());
  return out;
}

// Random loads; of a free body with forces, spread by area, that balance them, and displacements without their rigid
// part, in which two answers may differ at will.
class Trials {
 public:
  Trials(const TriangleMesh& mesh, const VoxelSolid& solid, const IdentifiedNetwork& network, const MatrixXd& grounding)
      : surface(measureNodes(mesh, network.patches)), mesh_(mesh), network_(network), grounding_(grounding) {
    if (grounding.size() == 0) return;
    felt_ = solid.loading.transpose() *
            rigidMotions(solid.grid.nodes, network.frames[0].restPosition, 3, network.lengthScale);
    rigid_ = rigidMotions(mesh.vertices, network.frames[0].restPosition, 3, network.lengthScale);
    VectorXd areas(rigid_.rows());
    for (Index k = 0; k < areas.size(); ++k) areas[k] = surface.areas[k / 3];
    weighted_ = areas.asDiagonal() * rigid_;
    feltWeighted_ = areas.asDiagonal() * felt_;
  }

  RowMatrix loads(LoadKind kind, int count, std::uint64_t seed) const {
    RowMatrix forces = randomLoads(mesh_, surface, kind, network_.lengthScale, count, seed);
    if (rigid_.size() > 0)
      forces -= feltWeighted_ * solvePositive(felt_.transpose() * feltWeighted_, felt_.transpose() * forces);
    return forces;
  }
  RowMatrix tractions(const RowMatrix& forces) const {
    const VectorXd areas = VectorXd::Map(surface.areas.data(), static_cast<Index>(surface.areas.size()));
    return areas.cwiseInverse().transpose().replicate<3, 1>().reshaped().asDiagonal() * forces;
  }
  MatrixXd exact(const VoxelSolid& solid, const RowMatrix& forces) const {
    return deformation(solid.surface * displacementsUnder(solid, forces));
  }
  MatrixXd ofFrames(const RowMatrix& forces) const { return deformation(framesResponse(network_, grounding_, forces)); }
  MatrixXd ofNetwork(const RowMatrix& forces) const {
    return deformation(framesResponse(network_, grounding_, forces) +
                       layerResponse(mesh_, surface, network_.layer, forces));
  }

  const NodeSurface surface;

 private:
  MatrixXd deformation(MatrixXd displacements) const {
    if (rigid_.size() > 0)
      displacements -= rigid_ * solvePositive(rigid_.transpose() * weighted_, weighted_.transpose() * displacements);
    return displacements;
  }

  const TriangleMesh& mesh_;
  const IdentifiedNetwork& network_;
  const MatrixXd& grounding_;
  // Of a free body: 3 nodes x 6, and times the nodes' areas; and what finite elements feel of forces on the nodes,
  // which they spread, in rigid motions: their pins carry nothing under loads that are balanced so.
  MatrixXd rigid_, weighted_, felt_, feltWeighted_;
};

// Calls `progress` at every trial of a fit, of which nobody knows how many there will be: nearer and nearer to the end
// of its part.
class FitProgress {
 public:
  FitProgress(const Progress& progress, double from, double length)
      : progress_(progress), from_(from), length_(length), trials_(std::make_shared<int>(0)) {}
  void operator()() const {
    constexpr double kUsual = 10;
    const double trials = ++*trials_;
    progress_(from_ + length_ * trials / (trials + kUsual));
  }

 private:
  const Progress& progress_;
  double from_, length_;
  std::shared_ptr<int> trials_;  // of all copies
};

// What finite elements say of a body and its cells.
struct Solved {
  const TriangleMesh& mesh;
  const VoxelSolid &solid, &larger;  // the same in larger cells
  const CellFrames& cells;
  const Responses& responses;
  const EndTwists& ends;
};

// Bodies are loaded on their surface, where loads spread over cells would leave a body's end unstretched and untwisted;
// responses to tractions alone leave maps too free, which send loads to the frames by the same numbers. So tractions
// get the largest weight among loads on the frames that costs the answer to either half of `forces` no more than these
// scatter: concentrated and random, they say little of ends, by two or three percent of the larger half's error where
// few spheres are. Each skin is judged with the layer that goes with it: maps that take over a part of the dents are
// the nearer without one. Of an end that is twisted beyond its frame no random load says anything.
void chooseSkin(const Solved& solved, const Trials& trials, const RowMatrix& forces, const MatrixXd& under,
                IdentifiedNetwork& out, const Progress& progress) {
  constexpr double kScatter = 0.025;
  constexpr double kTwist = 30;  // at unit energy, as each of the loads on the frames; 30 to 100 differ little
  const auto& [mesh, solid, larger, cells, responses, ends] = solved;
  const Index half = forces.cols() / 2;
  const VectorXd largest = largestOf(under);
  double first = 0, second = 0;
  std::vector<std::vector<SkinFrame>> skin;
  IdentifiedLayer layer;
  constexpr int count = 5;
  constexpr std::array<double, count> weights = {0, 3, 10, 100, 300};
  for (int k = 0; k < count; ++k) {
    const double weight = weights[k];
    const FitProgress trying(progress, 1. * k / count, 1. / count);
    out.skin = fitSkin(mesh, cells, out.patches,
                       responses.frames + weight * responses.framesUnderTractions + kTwist * ends.framesUnderTwists,
                       responses.nodes + weight * responses.nodesUnderTractions + kTwist * ends.nodesUnderTwists);
    out.layer =
        fitLayer(mesh, trials.surface, forces, under - trials.ofFrames(forces), largest, out.lengthScale, trying);
    const MatrixXd found = trials.ofNetwork(forces);
    const double bulk = errorOf(found.leftCols(half), under.leftCols(half)).rms,
                 poke = errorOf(found.rightCols(half), under.rightCols(half)).rms;
    if (weight == 0) {
      first = bulk;
      second = poke;
    } else if (!(std::max(bulk - first, poke - second) < kScatter * std::max(first, second))) {
      break;
    }
    skin = out.skin;
    layer = out.layer;
  }
  out.skin = skin;
  out.layer = layer;
}

void fitAndClampLinks(const CellFrames& cells, const Responses& responses, const LoadsOnCells& ends, LinkForm form,
                      IdentifiedNetwork& out, const Progress& progress) {
  fitLinks(responses.frames, responses.grounding, ends, out.lengthScale, form, out.links, progress);
  for (IdentifiedLink& link : out.links)
    if (link.frame1 >= static_cast<int>(cells.frames.size()) && isRowOfCells(out.links, cells.frames.size()))
      centreClamp(out.lengthScale, link);
}

// Fits skin and layer to loads of their own, then the links, from `unfitted` ones, to what the skin makes of
// twisted ends; measures the network on others, which nothing was fitted to, and solves those again in larger cells.
void fitSurfaceAndMeasure(const Solved& solved, const std::vector<IdentifiedLink>& unfitted, LinkForm form,
                          Identification& result, const Progress& progress) {
  constexpr int count = 16;
  const auto& [mesh, solid, larger, cells, responses, ends] = solved;
  IdentifiedNetwork& out = result.network;
  const Trials trials(mesh, solid, out, responses.grounding);
  RowMatrix all(3 * static_cast<Index>(mesh.vertices.size()), 4 * count);
  all << trials.loads(LoadKind::bulk, count, 1), trials.loads(LoadKind::poke, count, 1),
      trials.loads(LoadKind::bulk, count, 2), trials.loads(LoadKind::poke, count, 2);
  const MatrixXd exact = trials.exact(solid, all);
  progress(0.5);
  const RowMatrix teaching = all.leftCols(2 * count);
  const MatrixXd under = exact.leftCols(2 * count);
  chooseSkin(solved, trials, teaching, under, out, [&](double part) { progress(std::lerp(0.5, 0.9, part)); });
  if (!ends.cells.empty()) {
    const RowSparse skin = skinMatrix(out.skin, static_cast<int>(cells.frames.size()));
    out.links = unfitted;
    fitAndClampLinks(cells, responses, loadsOnEnds(ends, responses.frames, skin), form, out, {});
    out.layer = fitLayer(mesh, trials.surface, teaching, under - trials.ofFrames(teaching), largestOf(under),
                         out.lengthScale, FitProgress(progress, 0.9, 0.1));
  }
  // Finite elements feel the forces spread into tractions. Fits to consistent ones gained pokes a tenth and lost as
  // much of tubes that are stretched or twisted.
  const auto consistent = [&](Index first) {
    RowMatrix forces = consistentForces(solved.mesh, trials.tractions(all.middleCols(first, count)));
    for (std::size_t n = 0; n < trials.surface.held.size(); ++n)
      if (trials.surface.held[n]) forces.middleRows<3>(3 * static_cast<Index>(n)).setZero();
    return forces;
  };
  const RowMatrix bulk = consistent(2 * count), poke = consistent(3 * count);
  const MatrixXd bulkExact = exact.middleCols(2 * count, count), pokeExact = exact.rightCols(count);
  out.bulk = errorOf(trials.ofNetwork(bulk), bulkExact);
  out.poke = errorOf(trials.ofNetwork(poke), pokeExact);
  const MatrixXd inLarger = trials.exact(larger, all.rightCols(2 * count));
  const IdentifiedError ofBulk = errorOf(inLarger.leftCols(count), bulkExact),
                        ofPoke = errorOf(inLarger.rightCols(count), pokeExact);
  out.ofFiniteElements = {std::max(ofBulk.maximum, ofPoke.maximum), std::max(ofBulk.rms, ofPoke.rms)};
  result.forces = bulk;
  result.displacements = bulkExact;
  progress(1);
}

}  // namespace

Identification identifyNetwork(const SoftBodyModel& model, const std::vector<HeldRegion>& held,
                               const IdentifySettings& settings, const Progress& progress) {
  // Eigen sums products in blocks fitted to the caches: with these sizes in the same order on every processor.
  Eigen::setCpuCacheSizes(32768, 262144, 2097152);
  checkSettings(settings);
  checkModel(model, !held.empty());
  const TriangleMesh mesh{model.restNodes, model.triangles};
  Identification result;
  IdentifiedNetwork& out = result.network;
  out.poisson = settings.poisson;
  SolidSettings solidSettings{settings.poisson, {}, {}, settings.memoryMax};
  std::vector<std::vector<int>> patchTriangles;
  for (const HeldRegion& region : held) {
    patchTriangles.push_back(wholeTriangles(mesh, region));
    out.patches.push_back({region.text, region.nodes});
    solidSettings.heldTriangles.insert(solidSettings.heldTriangles.end(), patchTriangles.back().begin(),
                                       patchTriangles.back().end());
  }
  std::vector<int>& triangles = solidSettings.heldTriangles;  // each once, in however many regions
  sortUnique(triangles);
  solidSettings.heldSpaces = heldSpaces(mesh, held, patchTriangles);
  const auto stage = [&](double from, double to) -> Progress {
    return [&progress, from, to](double part) {
      if (progress) progress(std::lerp(from, to, part));
    };
  };
  std::vector<Ball> balls;
  for (const FillingSphere& s : model.spheres) balls.push_back({s.restBallCentre, s.radius});
  const CellSize cell = chooseSize(model, mesh, behindHeld(solidSettings.heldSpaces));
  Alongside<VoxelSolid> largerCells([&](const Progress& goOn) {
    return makeVoxelSolid(mesh, kLargerCells * metCellSize(mesh, cell.size), solidSettings, goOn);
  });
  VoxelSolid solid = makeSolid(model, mesh, cell, solidSettings, stage(0, 0.2));
  requireWithinReach(solid.grid, mesh, solidSettings.heldTriangles);
  const CellFrames cells = makeCellFrames(mesh, balls, solid);
  out.voxel = solid.grid.size;
  out.lengthScale = cells.lengthScale;
  out.links = layOutLinks(mesh, cells, out.patches, patchTriangles);
  requireLinked(mesh, cells, out.links, out.voxel);
  VoxelSolid larger = largerCells.get();
  solid.give = larger.give = giveOfHeld(mesh, solidSettings, solid, larger);
  const VectorXd areas = freeAreas(measureNodes(mesh, out.patches));
  Responses responses = solveFrames(solid, cells, areas, stage(0.2, 0.4));
  if (held.empty()) responses = balancedResponses(mesh, cells, responses);
  const std::vector<IdentifiedLink> unfitted = out.links;
  const EndTwists ends = solveEnds(mesh, solid, cells, unfitted, areas);
  fitAndClampLinks(cells, responses, {}, settings.links, out, stage(0.4, 0.85));
  out.frames = cells.frames;
  fitSurfaceAndMeasure({mesh, solid, larger, cells, responses, ends}, unfitted, settings.links, result, stage(0.85, 1));
  requireFinite(out);
  return result;
}

}  // namespace medulla
