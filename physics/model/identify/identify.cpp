#include "physics/model/identify/identify.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
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
#include "physics/model/identify/trials.h"
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
  double size = 0;     // m
  std::string remedy;  // what of the mesh or the spheres asks for cells as small; empty where the body's volume does
};

// Does what may be over budget, and tells then why.
template <class Do>
auto withRemedy(const CellSize& cell, const Do& act) {
  try {
    return act();
  } catch (const OverBudget& error) {
    throw std::runtime_error(error.what() + (cell.remedy.empty() ? "" : "; " + cell.remedy));
  }
}

std::string tooThin(const std::string& neck) {
  return "it is too thin for its size: the neck of " + neck;
}

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
                    const std::function<bool(const Vector3d&)>& behind, const Progress& progress) {
  constexpr double kMuch = 0.9;
  const std::optional<Neck> neck = narrowestNeck(mesh, widest, leastPart, [&progress] { progress(0); });
  if (!neck || neck->width / perNeck >= kMuch * found.size || behind(neck->place)) return found;
  return {neck->width / perNeck,
          tooThin(fmt::format("{:.2g} mm near {} m", 1e3 * neck->width, placeText(neck->place)))};
}

// Cells of the spheres span three cells of the grid or more, necks between parts of the body two; 1500 for the whole
// body take four seconds of two processors at seven spheres. Where what is held ends, displacements go as the root of
// the distance, which no polynomial follows, so that finer cells converge in the first order only: at 600 a gallbladder
// held by its neck bends half a percent less.
CellSize chooseSize(const SoftBodyModel& model, const TriangleMesh& mesh,
                    const std::function<bool(const Vector3d&)>& behind, double memoryMax, const Progress& progress) {
  constexpr double perSphere = 3, perNeck = 2, perBody = 1500;
  constexpr double partMin = 0.02;  // of the body: what hangs on a thinner neck moves with it alone
  double volume = 0;
  for (const FillingSphere& s : model.spheres) volume += s.volume;
  const double spheres = std::cbrt(volume / static_cast<double>(model.spheres.size())) / perSphere;
  const double ofBody = std::min(spheres, std::cbrt(volume / perBody));
  CellSize out{ofBody, ""};
  if (spheres <= ofBody)
    out.remedy = fmt::format("fewer spheres than {} would do with larger ones", model.spheres.size());
  withRemedy(out, [&] { requireRoom(mesh, ofBody, memoryMax); });  // before any search for necks in all of the box
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
      out = {neck / perNeck, tooThin(fmt::format("{:.2g} mm between spheres {} and {}, near {} m", 1e3 * neck,
                                                 link.sphere0, link.sphere1, placeText(place)))};
    }
  }
  return orNarrower(out, mesh, perNeck * ofBody, perNeck, partMin, behind, progress);
}

// Calls `progress` at every trial of a fit, of which nobody knows how many there will be: nearer and nearer to the end
// of its part.
std::function<void()> fitProgress(const Progress& progress, double from, double length) {
  constexpr double kUsual = 10;
  return [&progress, from, length, trials = 0.]() mutable {
    ++trials;
    progress(from + length * trials / (trials + kUsual));
  };
}

// What finite elements say of a body and its cells.
struct Solved {
  const VoxelSolid &solid, &larger;  // the same in larger cells
  const CellFrames& cells;
  const Responses& responses;
  const EndTwists& ends;
};

RowMatrix bulkAndPokes(const Trials& trials, int count, std::uint64_t seed) {
  RowMatrix out(3 * static_cast<Index>(trials.mesh.vertices.size()), 2 * count);
  out << trials.loads(LoadKind::bulk, count, seed), trials.loads(LoadKind::poke, count, seed);
  return out;
}

// Loads that skin and layer are fitted to, one half bulk, one half pokes, and what finite elements make of them.
struct Lessons {
  RowMatrix forces;
  MatrixXd displacements;
  VectorXd pokeWork;  // of the second half, on what the cells' own motion does not carry
};

IdentifiedLayer layerOf(const Trials& trials, const Lessons& lessons, const MatrixXd& left, double lengthScale,
                        const std::function<void()>& progress) {
  return fitLayer(trials.layer(), {lessons.forces, left, lessons.pokeWork}, lengthScale, progress);
}

// Bodies are loaded on their surface, where loads spread over cells would leave a body's end unstretched and untwisted;
// responses to tractions alone leave maps too free, which send loads to the frames by the same numbers. So tractions
// get the largest weight among loads on the frames that costs the answer to either half of the lessons no more than
// these scatter: concentrated and random, they say little of ends, by two or three percent of the larger half's error
// where few spheres are. Of an end that is twisted beyond its frame no random load says anything.
void chooseSkin(const Solved& solved, const Trials& trials, const Lessons& lessons, IdentifiedNetwork& out,
                const Progress& progress) {
  constexpr double kScatter = 0.025;
  constexpr double kTwist = 30;  // at unit energy, as each of the loads on the frames; 30 to 100 differ little
  const Responses& responses = solved.responses;
  const EndTwists& ends = solved.ends;
  const Index half = lessons.forces.cols() / 2;
  double first = 0, second = 0;
  std::vector<std::vector<SkinFrame>> skin;
  constexpr int count = 5;
  constexpr std::array<double, count> weights = {0, 3, 10, 100, 300};
  for (int k = 0; k < count; ++k) {
    const double weight = weights[k];
    progress(1. * k / count);
    out.skin = fitSkin(trials.mesh, solved.cells, out.patches,
                       responses.frames + weight * responses.framesUnderTractions + kTwist * ends.framesUnderTwists,
                       responses.nodes + weight * responses.nodesUnderTractions + kTwist * ends.nodesUnderTwists);
    const MatrixXd found = trials.ofNetwork(lessons.forces);
    const double bulk = errorOf(found.leftCols(half), lessons.displacements.leftCols(half)).rms,
                 poke = errorOf(found.rightCols(half), lessons.displacements.rightCols(half)).rms;
    if (weight == 0) {
      first = bulk;
      second = poke;
    } else if (!(std::max(bulk - first, poke - second) < kScatter * std::max(first, second))) {
      break;
    }
    skin = out.skin;
  }
  out.skin = skin;
}

// Cells that lie behind what is held but for a twentieth of their volume. Their links, as stiff as the penalty that
// holds them, would dictate the whole body's step without moving anything visible: of a gallbladder of 25 spheres held
// by its neck, one of 96 % asks for 216 substeps in 20 ms, and for 32 where it stands still, which costs .04 % of
// error. At 93 % that costs .1, at 90 % .4, and what is held by its half 2 %.
std::vector<int> framesBehindHeld(const CellFrames& cells) {
  constexpr double kWhole = 0.95;
  std::vector<int> out;
  for (std::size_t i = 0; i < cells.heldShare.size(); ++i)
    if (cells.heldShare[i] >= kWhole) out.push_back(static_cast<int>(i));
  return out;
}

void fitAndClampLinks(const CellFrames& cells, const Responses& responses, const LoadsOnCells& ends, LinkForm form,
                      IdentifiedNetwork& out, const Progress& progress) {
  fitLinks(responses.frames, responses.grounding, ends, out.lengthScale, form, out.links, progress);
  for (IdentifiedLink& link : out.links)
    if (link.frame1 >= static_cast<int>(cells.frames.size()) && isRowOfCells(out.links, cells.frames.size()))
      centreClamp(out.lengthScale, link);
}

// Fits skin, links and layer to `lessons`. The skins are judged beside one layer, that of the cells' exact motion; the
// links, from `unfitted` ones, follow what the skin makes of twisted ends, and the layer in the end what skin and links
// leave of displacements: where links give too much in a pull, a layer that gives less across. How deep a poke sinks,
// however, is the exact motion's: what links have too much or too little of does not help there.
void fitSurface(const Solved& solved, const Trials& trials, const RowMatrix& forces,
                const std::vector<IdentifiedLink>& unfitted, LinkForm form, IdentifiedNetwork& out,
                const Progress& progress) {
  const auto& [solid, larger, cells, responses, ends] = solved;
  const Index half = forces.cols() / 2;
  const RowMatrix solution = displacementsUnder(solid, forces);
  const MatrixXd onSurface = solid.surface * solution;
  const MatrixXd beside =
      trials.deformation(onSurface - responses.nodes * solvePositive(responses.frames, cells.motion * solution));
  const Lessons lessons{forces, trials.deformation(onSurface),
                        forces.rightCols(half).cwiseProduct(beside.rightCols(half)).colwise().sum().transpose()};
  progress(0.2);
  out.layer = layerOf(trials, lessons, beside, out.lengthScale, fitProgress(progress, 0.2, 0.3));
  chooseSkin(solved, trials, lessons, out, [&](double part) { progress(std::lerp(0.5, 0.7, part)); });
  if (!ends.cells.empty()) {
    const RowSparse skin = skinMatrix(out.skin, static_cast<int>(cells.frames.size()));
    out.links = unfitted;
    fitAndClampLinks(cells, responses, loadsOnEnds(ends, responses.frames, skin), form, out, [](double) {});
  }
  out.layer = layerOf(trials, lessons, lessons.displacements - trials.ofFrames(forces), out.lengthScale,
                      fitProgress(progress, 0.7, 0.3));
}

// The network's errors under loads that nothing was fitted to, and the finite elements' by solving those again in
// larger cells. Finite elements feel the forces spread into tractions. Fits to consistent ones gained pokes a tenth and
// lost as much of tubes that are stretched or twisted.
void measure(const Solved& solved, const Trials& trials, int count, Identification& result) {
  IdentifiedNetwork& out = result.network;
  const RowMatrix loads = bulkAndPokes(trials, count, 2);
  const MatrixXd exact = trials.exact(solved.solid, loads), inLarger = trials.exact(solved.larger, loads);
  const RowMatrix bulk = trials.consistent(loads.leftCols(count)), poke = trials.consistent(loads.rightCols(count));
  const MatrixXd bulkExact = exact.leftCols(count), pokeExact = exact.rightCols(count);
  out.bulk = errorOf(trials.ofNetwork(bulk), bulkExact);
  out.poke = errorOf(trials.ofNetwork(poke), pokeExact);
  const IdentifiedError ofBulk = errorOf(inLarger.leftCols(count), bulkExact),
                        ofPoke = errorOf(inLarger.rightCols(count), pokeExact);
  out.ofFiniteElements = {std::max(ofBulk.maximum, ofPoke.maximum), std::max(ofBulk.rms, ofPoke.rms)};
  result.forces = bulk;
  result.displacements = bulkExact;
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
  // Nearer to a half the factors drown in rounding, by a fifth of a bar's give in the end; up to there nothing locks.
  constexpr double kFirmest = 0.499999;
  SolidSettings solidSettings{std::min(settings.poisson, kFirmest), {}, {}, settings.memoryMax};
  const std::vector<std::vector<int>> patchTriangles = heldTriangles(mesh, held);
  for (const HeldRegion& region : held) out.patches.push_back({region.text, region.nodes});
  std::vector<int>& triangles = solidSettings.heldTriangles;  // each once, in however many regions
  for (const std::vector<int>& of : patchTriangles) triangles.insert(triangles.end(), of.begin(), of.end());
  sortUnique(triangles);
  solidSettings.heldSpaces = heldSpaces(mesh, held, patchTriangles);
  const auto stage = [&](double from, double to) -> Progress {
    return [&progress, from, to](double part) { progress(std::lerp(from, to, part)); };
  };
  const CellSize cell =
      chooseSize(model, mesh, behindHeld(solidSettings.heldSpaces), settings.memoryMax, stage(0, 0.2));
  Alongside<VoxelSolid> largerCells([&](const Progress& goOn) {
    return makeVoxelSolid(mesh, kLargerCells * metCellSize(mesh, cell.size), solidSettings, goOn);
  });
  VoxelSolid solid = withRemedy(cell, [&] { return makeVoxelSolid(mesh, cell.size, solidSettings, stage(0, 0.2)); });
  requireWithinReach(solid.grid, mesh, solidSettings.heldTriangles);
  const CellFrames cells = makeCellFrames(mesh, ballsOf(model), solid);
  out.voxel = solid.grid.size;
  out.lengthScale = cells.lengthScale;
  out.heldFrames = framesBehindHeld(cells);
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
  const Solved solved{solid, larger, cells, responses, ends};
  const Trials trials(model, solid, out, responses.grounding);
  constexpr int count = 16;
  fitSurface(solved, trials, bulkAndPokes(trials, count, 1), unfitted, settings.links, out, stage(0.85, 0.97));
  measure(solved, trials, count, result);
  stage(0.97, 1)(1);
  requireFinite(out);
  return result;
}

}  // namespace medulla
