#include <fmt/format.h>

#include <algorithm>

#include "app/commands/commands.h"
#include "app/commands/mesh_notes.h"
#include "app/enum_names.h"
#include "app/files/csv_rows.h"
#include "app/files/input_error.h"
#include "app/files/log_table.h"
#include "app/files/mesh_file.h"
#include "app/files/model_file.h"
#include "app/files/recording_file.h"
#include "app/files/state_cache.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/files/trajectory_file.h"
#include "app/files/xml_element.h"
#include "app/standard_streams.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/model/build_report.h"
#include "physics/model/mesh_repair.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

namespace {

std::vector<Result> modelResults(const SoftBodyModel& model) {
  constexpr double densityOfWater = 1000;
  double radiusMin = std::numeric_limits<double>::infinity(), radiusMax = 0;
  for (const FillingSphere& s : model.spheres) {
    radiusMin = std::min(radiusMin, s.radius);
    radiusMax = std::max(radiusMax, s.radius);
  }
  const BuildReport report = measureModel(model);
  std::vector<Result> results = {{"kind", "model", ""},
                                 {"name", model.name, ""},
                                 {"settings", model.settings, ""},
                                 {"mesh_hash", fmt::format("{:016x}", model.meshHash), ""},
                                 {"input_vertices", numberText(model.nodeOfInputVertex.size()), ""},
                                 {"nodes", numberText(model.restNodes.size()), ""},
                                 {"render_triangles", numberText(model.renderSurface.triangles.size()), ""},
                                 {"mass_at_1000_kg/m3", numberText(densityOfWater * report.volume), "kg"},
                                 {"extents", vectorText(Eigen::Vector3d(boundsOf(model.restNodes).sizes())), "m"},
                                 {"radius_min", numberText(radiusMin), "m"},
                                 {"radius_max", numberText(radiusMax), "m"}};
  for (const Result& r : buildResults(report))
    if (r.name != "seconds") results.push_back(r);
  if (model.identified) {
    for (const Result& r : identifiedResults(*model.identified, std::nullopt)) results.push_back(r);
    results.push_back({"identified_poisson", numberText(model.identified->poisson), ""});
  }
  return results;
}

std::size_t linkCount(const SceneBody& body) {
  return body.links == LinkModel::identified ? body.model->identified->links.size() : body.model->links.size();
}

void addBody(const SceneBody& body, std::vector<Result>& results) {
  const SoftBodyModel& model = *body.model;
  const auto add = [&](const char* name, const std::string& value, const char* unit) {
    results.push_back({fmt::format("body.{}.{}", body.name, name), value, unit});
  };
  const double volume = enclosedVolume({model.restNodes, model.triangles});
  add("spheres", numberText(model.spheres.size()), "");
  add("links", numberText(linkCount(body)), "");
  add("nodes", numberText(model.restNodes.size()), "");
  add("triangles", numberText(model.triangles.size()), "");
  add("mass", numberText(volume * body.tissue.density), "kg");
  add("young", numberText(body.tissue.young), "Pa");
  add("poisson", numberText(body.tissue.poisson), "");
  add("damping", numberText(body.tissue.damping), "");
  add("link_model", nameOf(body.links), "");
  add("surface", nameOf(body.surface), "");
  add("look", body.look, "");
  add("fixed_spheres", numberText(body.fixed.size()), "");
  add("fixed_nodes", numberText(body.fixedNodes.size()), "");
  add("driven_spheres", numberText(body.driven.size()), "");
}

// Undamped, of the whole body as it is held.
void addFrequencies(const BodyDescription& body, std::vector<Result>& results) {
  constexpr int kShown = 5;
  constexpr std::size_t kMostSpheres = 200;  // 2 s; beyond, time grows with the cube
  if (body.model->spheres.size() > kMostSpheres) return;
  std::vector<std::string> list;
  for (const double f : naturalFrequencies(body, bodyMechanics(body), kShown)) list.push_back(fmt::format("{:.4g}", f));
  if (!list.empty())
    results.push_back({fmt::format("body.{}.natural_frequencies", body.name), joined(list, " "), "Hz"});
}

// s, by the estimate: of a scene that runs in implicit steps, too, of the dampers that explicit ones would have.
double stableSubstep(const Scene& scene, const World& world) {
  if (scene.dynamics.integrator == Integrator::explicitEuler) return world.stableSubstep();
  WorldSettings settings = scene.dynamics;
  settings.integrator = Integrator::explicitEuler;
  settings.order = 1;
  settings.substeps = 1;
  return World(settings, {scene.bodies.begin(), scene.bodies.end()}).stableSubstep();
}

std::vector<Result> sceneResults(const LoadedScene& loaded) {
  const Scene& scene = loaded.scene;
  const World world = makeWorld(loaded);
  std::size_t spheres = 0, links = 0, nodes = 0;
  for (const SceneBody& body : scene.bodies) {
    spheres += body.model->spheres.size();
    links += linkCount(body);
    nodes += body.model->restNodes.size();
  }
  std::vector<Result> results = {{"kind", "scene", ""},
                                 {"name", scene.name, ""},
                                 {"duration", numberText(scene.duration), "s"},
                                 {"servo", numberText(scene.servoRate), "Hz"},
                                 {"dynamics", numberText(scene.dynamicsRate), "Hz"},
                                 {"substeps_per_frame", fmt::format("{}", world.substepsPerFrame()), ""},
                                 {"substep", numberText(world.substep()), "s"},
                                 {"stable_substep", numberText(stableSubstep(scene, world)), "s"},
                                 {"gravity", vectorText(scene.dynamics.gravity), "m/s2"},
                                 {"picture", fmt::format("{}x{}", scene.width, scene.height), ""},
                                 {"fps", numberText(scene.fps), "Hz"},
                                 {"bodies", numberText(scene.bodies.size()), ""},
                                 {"statics", numberText(scene.statics.size()), ""},
                                 {"tools", numberText(scene.tools.size()), ""},
                                 {"spheres", numberText(spheres), ""},
                                 {"links", numberText(links), ""},
                                 {"nodes", numberText(nodes), ""}};
  for (const SceneBody& body : scene.bodies) {
    addBody(body, results);
    addFrequencies(body, results);
  }
  for (const SceneTool& tool : scene.tools)
    results.push_back({fmt::format("tool.{}.radius", tool.name), numberText(tool.settings.radius), "m"});
  return results;
}

// Where a motion lies and when its grip closes: what the frame of a recording is fitted by.
std::vector<Result> trajectoryResults(const Trajectory& trajectory) {
  const std::vector<ToolSample>& samples = trajectory.samples;
  Eigen::AlignedBox3d box;
  double speed = 0, gap = 0, force = 0;
  int closings = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    box.extend(samples[k].position);
    if (samples[k].grip > kGripCloses && (k == 0 || samples[k - 1].grip <= kGripCloses)) ++closings;
    if (k == 0) continue;
    const double step = samples[k].time - samples[k - 1].time;
    gap = std::max(gap, step);
    speed = std::max(speed, (samples[k].position - samples[k - 1].position).norm() / step);
  }
  for (const Eigen::Vector3d& f : trajectory.measuredForces) force = std::max(force, f.norm());
  std::vector<Result> results = {{"kind", "trajectory", ""},
                                 {"samples", numberText(samples.size()), ""},
                                 {"from", numberText(samples.front().time), "s"},
                                 {"to", numberText(samples.back().time), "s"},
                                 {"gap_max", numberText(gap), "s"},
                                 {"lower", vectorText(box.min()), "m"},
                                 {"upper", vectorText(box.max()), "m"},
                                 {"speed_max", numberText(speed), "m/s"},
                                 {"grip_closings", fmt::format("{}", closings), ""}};
  if (!trajectory.measuredForces.empty()) results.push_back({"force_measured_max", numberText(force), "N"});
  return results;
}

// What stands in the way of a model is told, not thrown: one looks at a mesh to learn what it lacks.
std::vector<Result> meshResults(const std::string& path, const std::string& unit) {
  const TriangleMesh mesh = readMesh(path, metresPerUnit(unit));
  const Eigen::AlignedBox3d box = boundsOf(mesh.vertices);
  std::vector<Result> results = {{"kind", "mesh", ""},
                                 {"input_vertices", numberText(mesh.vertices.size()), ""},
                                 {"input_triangles", numberText(mesh.triangles.size()), ""},
                                 {"lower", vectorText(box.min()), "m"},
                                 {"upper", vectorText(box.max()), "m"},
                                 {"diagonal", numberText(boundsDiagonal(mesh)), "m"}};
  noteSize(path, mesh);
  try {
    const RepairedMesh repaired = repairMesh(mesh);
    noteRepairs(path, repaired.notes);
    noteCost(path, repaired.mesh);
    results.insert(results.end(), {{"nodes", numberText(repaired.mesh.vertices.size()), ""},
                                   {"triangles", numberText(repaired.mesh.triangles.size()), ""},
                                   {"volume", numberText(enclosedVolume(repaired.mesh)), "m3"},
                                   {"buildable", "yes", ""}});
  } catch (const std::runtime_error& why) {
    tell("{}: note: no model can be built: {}\n", path, why.what());
    results.push_back({"buildable", "no", ""});
  }
  return results;
}

std::vector<Result> cacheResults(const std::string& path) {
  const CacheReader cache(path);
  const CacheLayout& layout = cache.layout();
  std::vector<std::string> bodies;
  for (const CacheLayout::Body& body : layout.bodies) bodies.push_back(body.name);
  return {{"kind", "cache", ""},
          {"pictures", fmt::format("{}", cache.pictures()), ""},
          {"fps", numberText(layout.fps), "Hz"},
          {"bodies", joined(bodies, " "), ""},
          {"tools", joined(layout.tools, " "), ""},
          {"hash", fmt::format("{:016x}", cache.finalHash()), ""}};
}

std::vector<Result> logResults(const std::string& path) {
  const LogTable log = readLog(path);
  if (log.isCut) tell("{}: note: ends in the midst of a row\n", path);
  const std::string kind = isOneOf("servo", log.columns) ? "frame_times" : "log";
  std::vector<Result> results = {
      {"kind", kind, ""}, {"rows", numberText(log.value.size()), ""}, {"columns", numberText(log.columns.size()), ""}};
  if (log.value.empty()) return results;
  results.push_back({"from", numberText(log.value.front()[0]), "s"});
  results.push_back({"to", numberText(log.value.back()[0]), "s"});
  return results;
}

std::vector<Result> tableResults(const std::string& path, const std::string& table) {
  if (table.find('\0') != std::string::npos)
    throw inputError(
        path, 0,
        "is of no kind that is known here, expected a mesh, a model, a scene, a trajectory, a recording, a "
        "log or a state cache");
  CsvRows rows(table, path);
  const bool isLog = rows.next() && (isOneOf("energy.kinetic", rows.cells()) || isOneOf("servo", rows.cells()));
  return isLog ? logResults(path) : trajectoryResults(readTrajectory(path));
}

std::vector<Result> xmlResults(const std::string& path) {
  const std::string root = rootElementOf(path);
  if (root == "recording") return trajectoryResults(readRecording(readRecordingMap(path)));
  if (root == "model") return modelResults(readModel(path));
  RunOptions run;  // any other root is refused as no scene
  run.scene = path;
  return sceneResults(loadRun(run));
}

std::vector<Result> resultsOf(const InfoOptions& options) {
  if (isMeshFile(options.path)) return meshResults(options.path, options.unit);
  if (isCache(options.path)) return cacheResults(options.path);
  const std::string content = readTextFile(options.path);
  if (trimmed(content).empty()) throw inputError(options.path, 0, "is empty, expected a scene, a model or a table");
  return beginsAsXml(content) ? xmlResults(options.path) : tableResults(options.path, content);
}

}  // namespace

int runInfo(const InfoOptions& options) {
  printResults(resultsOf(options));
  return 0;
}

}  // namespace medulla
