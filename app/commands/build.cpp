#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>

#include "app/commands/commands.h"
#include "app/commands/mesh_notes.h"
#include "app/enum_names.h"
#include "app/files/fix_text.h"
#include "app/files/input_error.h"
#include "app/files/mesh_file.h"
#include "app/files/model_file.h"
#include "app/files/output_file.h"
#include "app/files/report_file.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/interrupt.h"
#include "app/progress.h"
#include "app/standard_streams.h"
#include "physics/dynamics/fixation.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/model/ball_choice.h"
#include "physics/model/build_report.h"
#include "physics/model/identify/check_loads.h"
#include "physics/model/identify/held_region.h"
#include "physics/model/identify/slits.h"
#include "physics/model/identify/thin_parts.h"
#include "physics/model/node_volumes.h"
#include "physics/model/render_surface.h"
#include "physics/sort_unique.h"
#include "render/output_folder.h"
#include "render/stage_times.h"

namespace medulla {

namespace fs = std::filesystem;

namespace {

struct BuildJob {
  std::string meshPath, finePath, modelPath, name;
  std::uint64_t inputHash = 0;
  RepairedMesh mesh;
  TriangleMesh fine;
  std::vector<HeldRegion> held;
  BuildSettings settings;
  SoftBodyModel model;
  BuildReport report;
  std::optional<IdentifiedError> formulas;  // of the beams' formulas, where a network was identified
};

// The command that repeats the build, file names without folders: the model is the same in whatever folder it is built,
// and the same whether it is built alone or with others.
std::string repeatingCommand(const BuildJob& job, const BuildOptions& options) {
  std::string command = fmt::format("medulla build {} {}", shellWord(fs::path(job.meshPath).filename().string()),
                                    describeSettings(job.settings));
  if (options.unit != "m") command += " --unit " + options.unit;
  if (!job.finePath.empty()) command += " --fine " + shellWord(fs::path(job.finePath).filename().string());
  if (options.identify) {
    command += fmt::format(" --identify --poisson {} --link-form {}", options.identification.poisson,
                           nameOf(options.identification.links));
    for (const FixedPatch& patch : job.model.identified->patches) command += " --fix " + shellWord(patch.region);
  }
  return command;
}

// What goes wrong with one mesh is said with its name.
template <typename Work>
auto naming(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", path, error.what()));
  }
}

// A scene of it would move as bags of skin do, or turn inside out.
void warnOfCover(const BuildJob& job) {
  constexpr double kLeast = 40;  // %; the scenes' leanest model, of limbs, has 58
  if (job.report.cover >= kLeast) return;
  const bool chosen = job.settings.method == BuildMethod::cover;  // how many there are of a skeleton follows from it
  tell("{}: note: the spheres cover {:.2g} % of the volume{}\n", job.meshPath, job.report.cover,
       chosen ? "; do more of them (--spheres) fit it better?" : "");
}

void noteDropped(const BuildJob& job) {
  const BuildSettings& asked = job.settings;
  if (asked.method == BuildMethod::cover && asked.gap == 0 && job.report.spheres < asked.spheres)
    tell("{}: note: {} spheres, not {}: the others would have no material of their own\n", job.meshPath,
         job.report.spheres, asked.spheres);
}

// What no number of spheres makes good.
void warnOfShape(const BuildJob& job) {
  constexpr double kManyLinks = 0.25;
  if (const std::optional<LongEdges>& coarse = job.report.longEdges)
    tell(
        "{}: note: edges of {:.3g} mm on a body {:.3g} mm thick: split them to {:.3g} mm or use a finer mesh; "
        "results may be off by a third, mostly too soft\n",
        job.meshPath, 1e3 * coarse->edge, 1e3 * coarse->thickness, 500 * coarse->thickness);
  if (!job.model.identified && job.report.hollowLinks > kManyLinks * job.report.links)
    tell(
        "{}: note: {} of {} links lie in a hollow or beside the body: beams may be far too soft; use medulla build "
        "--identify\n",
        job.meshPath, job.report.hollowLinks, job.report.links);
  constexpr double kFewNodes = 0.01;
  if (!job.model.identified && job.report.attachmentsCrossing > kFewNodes * double(job.model.restNodes.size()))
    tell(
        "{}: note: {} of {} surface nodes hang on what lies outside of their part of the body, and a fin or limb may "
        "be torn where it bends: more spheres (--spheres) reach into it, or use medulla build --identify\n",
        job.meshPath, job.report.attachmentsCrossing, job.model.restNodes.size());
  constexpr double kMostLinks = 0.5;
  if (!job.model.identified && job.report.sheetLinks > kMostLinks * job.report.links)
    tell(
        "{}: note: {} of {} links lie in a sheet: beams resist its bending by a third to a half too much; use "
        "medulla build --identify\n",
        job.meshPath, job.report.sheetLinks, job.report.links);
}

// Loop subdivision draws a coarse mesh much rounder than it is.
void warnOfDrawnSurface(const BuildJob& job) {
  constexpr double kSeen = 2;  // %
  if (job.report.drawnInsideMax <= kSeen) return;
  tell(
      "{}: note: the drawn surface lies up to {:.2g} % of the diagonal inside the mesh, so that tools seem to "
      "press on air; use a finer mesh{}\n",
      job.meshPath, job.report.drawnInsideMax,
      job.finePath.empty() ? ", or, where no corner is sharp, medulla build --fine " + shellWord(job.meshPath) : "");
}

// Of what the scene will get: links of the network, or of the beams' formulas.
void warnOfErrors(const BuildJob& job) {
  constexpr double kLinks = 10, kElements = 5;  // %, RMS
  if (!job.model.identified) return;
  const IdentifiedNetwork& n = *job.model.identified;
  const double links = n.usesFormulas ? job.formulas->rms : n.bulk.rms;
  if (links > kLinks || n.ofFiniteElements.rms > kElements)
    tell(
        "{}: note: the links are off by {:.2g} % RMS, finite elements by {:.2g}; {} fit better, or more that "
        "is held?\n",
        job.meshPath, links, n.ofFiniteElements.rms, job.report.longEdges ? "does a finer mesh" : "do more spheres");
  constexpr double kPokes = 15, kAtMost = 100;  // %, RMS and of the farthest node
  if (!n.usesFormulas && (n.poke.rms > kPokes || n.poke.maximum > kAtMost))
    tell("{}: note: dents where something pokes are off by {:.2g} % RMS, {:.2g} at most, by the builder's own loads\n",
         job.meshPath, n.poke.rms, n.poke.maximum);
}

// Finite elements know nothing of what is thinner than they are.
void warnOfSlits(const BuildJob& job) {
  if (!job.model.identified) return;
  const double voxel = job.model.identified->voxel;
  if (const auto slit = narrowestSlit({job.model.restNodes, job.model.triangles}, voxel))
    tell(
        "{}: note: gaps down to {:.2g} mm, as near {} m, are bridged by finite elements of {:.2g} mm, which tie "
        "their walls together: more spheres make smaller ones\n",
        job.meshPath, 1e3 * slit->width, placeText(slit->place), 1e3 * voxel);
}

std::vector<BuildJob> jobsOf(const BuildOptions& options) {
  std::vector<BuildJob> jobs;
  if (options.meshes.size() > 1 && fs::path(options.output).extension() == ".xml")
    throw std::runtime_error(fmt::format("{}: expected the name of a folder for the models of {} meshes",
                                         options.output, options.meshes.size()));
  for (std::size_t m = 0; m < options.meshes.size(); ++m) {
    BuildJob& job = jobs.emplace_back();
    job.meshPath = options.meshes[m];
    if (!options.fine.empty()) job.finePath = options.fine[m];
    job.name = fs::path(job.meshPath).stem().string();
    job.modelPath =
        options.meshes.size() == 1 ? options.output : (fs::path(options.output) / (job.name + ".model.xml")).string();
    job.settings = options.settings;
  }
  return jobs;
}

// Scenes and recordings end in .xml, too.
void requireReplaceable(const std::string& path) {
  if (fileExists(path) && !isModel(path))
    throw inputError(path, 0, "is no model: expected one to replace, or a name that is free");
}

void requireDistinct(const BuildOptions& options, const std::vector<BuildJob>& jobs) {
  std::vector<std::string> outputs{options.reportPath}, inputs = options.fine;
  for (const BuildJob& job : jobs) {
    outputs.push_back(job.modelPath);
    inputs.push_back(job.meshPath);
  }
  for (const std::string& text : options.fix)
    if (const std::string file = vertexFileOf(text); !file.empty()) inputs.push_back(file);
  requireDistinctFiles(outputs, inputs);
  requireWritable(outputs);
  for (const BuildJob& job : jobs) requireReplaceable(job.modelPath);
}

void readMeshes(const BuildOptions& options, std::vector<BuildJob>& jobs) {
  const double scale = metresPerUnit(options.unit);
  for (BuildJob& job : jobs) {
    const TriangleMesh input = readMesh(job.meshPath, scale);
    job.inputHash = hashMesh(input);
    job.mesh = naming(job.meshPath, [&] { return repairMesh(input); });
    noteSize(job.meshPath, input);  // of one that is not refused
    noteRepairs(job.meshPath, job.mesh.notes);
    noteCost(job.meshPath, job.mesh.mesh);
    job.settings.renderLevels = options.renderLevels.value_or(renderLevelsFor(job.mesh.mesh.triangles.size()));
    if (!job.finePath.empty()) job.fine = readMesh(job.finePath, scale);
  }
}

// A run holds every node, finite elements what lies between three of them.
void noteStrayNodes(const BuildJob& job, const std::vector<std::vector<int>>& triangles) {
  constexpr double kFew = 0.1;  // of those held: some at the rim of a box do no harm
  std::vector<int> nodes, whole;
  for (const HeldRegion& region : job.held) nodes.insert(nodes.end(), region.nodes.begin(), region.nodes.end());
  for (const std::vector<int>& of : triangles) whole.insert(whole.end(), of.begin(), of.end());
  sortUnique(nodes);
  const std::vector<bool> isCorner = nodesOfTriangles(job.mesh.mesh, whole);
  const auto stray = std::count_if(nodes.begin(), nodes.end(), [&](int n) { return !isCorner[n]; });
  if (static_cast<double>(stray) > kFew * static_cast<double>(nodes.size()))
    tell("{}: note: {} of {} nodes that are held are no corners of a held triangle: finite elements let them go\n",
         job.meshPath, stray, nodes.size());
}

// Of the repaired mesh, whose vertices a model's nodes are: a mistake in what is to be held shows before any work.
void readHeldRegions(const BuildOptions& options, BuildJob& job) {
  SoftBodyModel surface;
  surface.restNodes = job.mesh.mesh.vertices;
  surface.nodeOfInputVertex = job.mesh.vertexOfInput;
  naming(job.meshPath, [&] {
    for (const std::string& text : options.fix) job.held.push_back(parseHeldRegion(text, surface));
    noteStrayNodes(job, heldTriangles(job.mesh.mesh, job.held));
  });
}

// Shows a stage's part of the work, from `from` on and `length` long in parts of the whole.
std::function<void(double)> shownOn(Progress& progress, double from = 0, double length = 1) {
  return [&progress, from, length](double share) {
    checkInterrupt();
    progress.update(100 * (from + length * share));
  };
}

// The spheres asked for are those of all bodies together.
void divideSpheres(std::vector<BuildJob>& jobs) {
  std::vector<BodyShape> shapes;
  shapes.reserve(jobs.size());
  BuildSettings average = jobs[0].settings;
  average.spheres = std::max(1, average.spheres / static_cast<int>(jobs.size()));
  Progress progress("share spheres", 100, "%");
  const auto measured = shownOn(progress, 0, 0.5);
  for (const BuildJob& job : jobs) {
    measured(static_cast<double>(shapes.size()) / static_cast<double>(jobs.size()));
    shapes.push_back(naming(job.meshPath, [&] { return measureShape(job.mesh.mesh, overshootOf(average)); }));
  }
  const std::vector<int> counts = shareSpheres(shapes, jobs[0].settings.spheres, shownOn(progress, 0.5, 0.5));
  for (std::size_t j = 0; j < jobs.size(); ++j) jobs[j].settings.spheres = counts[j];
}

void buildAll(std::vector<BuildJob>& jobs) {
  Progress progress("build", 100, "%");
  for (std::size_t j = 0; j < jobs.size(); ++j) {
    BuildJob& job = jobs[j];
    const double length = 1 / static_cast<double>(jobs.size());
    const auto shown = shownOn(progress, static_cast<double>(j) * length, length);
    job.model = naming(job.meshPath, [&] {
      return buildModel(job.mesh, job.finePath.empty() ? nullptr : &job.fine, job.settings, job.report, shown);
    });
    job.model.name = job.name;
    job.model.meshHash = job.inputHash;
  }
}

// Of the beams' formulas, on the loads that the identified network was measured on; both without regard to dents, which
// formulas leave to the surface. None where what is held leaves the body free to move.
std::optional<IdentifiedError> errorOfFormulas(const BuildJob& job, const Identification& found) {
  BodyDescription body;
  body.model = std::make_shared<SoftBodyModel>(job.model);
  body.tissue.young = 1;
  body.tissue.poisson = found.network.poisson;
  for (const FixedPatch& patch : found.network.patches)
    body.fixedNodes.insert(body.fixedNodes.end(), patch.nodes.begin(), patch.nodes.end());
  sortUnique(body.fixedNodes);
  for (const int sphere : spheresHeldBy(job.model, body.fixedNodes)) body.fixed.push_back({sphere});
  const auto response = skeletonResponse(body, bodyMechanics(body), found.forces);
  if (!response) return std::nullopt;
  return errorOf(*response, found.displacements);
}

// Keeps the formulas where they are nearer: links and skin are then left out.
void chooseFormulasIfBetter(BuildJob& job, IdentifiedNetwork& network, const Identification& found) {
  if (network.patches.empty()) return;  // beams alone do not answer a free body's loads at rest
  job.formulas = errorOfFormulas(job, found);
  if (!job.formulas || job.formulas->rms >= network.bulk.rms) return;
  tell("{}: note: beams' formulas are nearer to finite elements ({:.2g} against {:.2g} % RMS): kept\n", job.meshPath,
       job.formulas->rms, network.bulk.rms);
  network.usesFormulas = true;
  network.heldFrames.clear();
  network.links.clear();
  network.skin.clear();
}

void identifyModel(const BuildOptions& options, BuildJob& job) {
  const double start = wallSeconds();
  Progress progress("identify", 100, "%");
  job.model.identified = naming(job.meshPath, [&] {
    const Identification found = identifyNetwork(job.model, job.held, options.identification, shownOn(progress));
    progress.end();
    auto network = std::make_shared<IdentifiedNetwork>(found.network);
    chooseFormulasIfBetter(job, *network, found);
    if (network->usesFormulas) return network;
    shareOutMassByLayer(network->layer, job.settings.surfaceMassFraction, job.model);
    const BuildReport before = job.report;  // of frames that have moved since
    job.report = measureModel(job.model);
    job.report.hollowLinks = before.hollowLinks;
    job.report.longEdges = before.longEdges;
    job.report.seconds = before.seconds;
    return network;
  });
  job.report.seconds += wallSeconds() - start;
}

std::vector<Result> resultsOf(const std::vector<BuildJob>& jobs) {
  if (jobs.size() == 1) {
    std::vector<Result> results = buildResults(jobs[0].report);
    if (jobs[0].model.identified)
      for (const Result& r : identifiedResults(*jobs[0].model.identified, jobs[0].formulas)) results.push_back(r);
    return results;
  }
  std::vector<Result> results;
  std::vector<BuildReport> reports;
  std::set<std::string> names;
  for (const BuildJob& job : jobs) {
    const std::string plain = plainName(job.name);
    std::string name = plain;
    for (std::ptrdiff_t k = &job - jobs.data() + 1; !names.insert(name).second; ++k)
      name = fmt::format("{}_{}", plain, k);
    for (Result& r : buildResults(job.report)) results.push_back({name + "." + r.name, r.value, r.unit});
    reports.push_back(job.report);
  }
  for (Result& r : totalResults(reports)) results.push_back({"total." + r.name, r.value, r.unit});
  return results;
}

}  // namespace

int runBuild(const BuildOptions& options) {
  std::vector<BuildJob> jobs = jobsOf(options);
  std::optional<OutputFolder> folder;
  if (jobs.size() > 1) folder.emplace(options.output);
  requireDistinct(options, jobs);
  readMeshes(options, jobs);
  readHeldRegions(options, jobs[0]);  // --fix asks for --identify, and that for a single mesh
  const bool shared = jobs.size() > 1 && options.settings.method == BuildMethod::cover && options.settings.gap == 0;
  if (shared) divideSpheres(jobs);
  buildAll(jobs);
  if (options.identify) identifyModel(options, jobs[0]);
  for (BuildJob& job : jobs) job.model.settings = repeatingCommand(job, options);
  const std::vector<Result> results = resultsOf(jobs);
  for (const BuildJob& job : jobs) writeModel(job.modelPath, job.model);
  for (const BuildJob& job : jobs) noteDropped(job);
  for (const BuildJob& job : jobs) warnOfCover(job);
  for (const BuildJob& job : jobs) warnOfShape(job);
  for (const BuildJob& job : jobs) warnOfDrawnSurface(job);
  for (const BuildJob& job : jobs) {
    warnOfErrors(job);
    warnOfSlits(job);
  }
  if (!options.reportPath.empty()) writeReport(options.reportPath, results);
  printResults(results);
  return 0;
}

}  // namespace medulla
