#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string_view>
#include <vector>

#include "app/files/fix_text.h"
#include "app/files/mesh_file.h"
#include "app/files/model_file.h"
#include "app/files/recording_file.h"
#include "app/files/text.h"
#include "app/files/text_file.h"
#include "app/files/trajectory_file.h"
#include "app/files/vertex_file.h"
#include "app/files/xml_element.h"
#include "app/shape_mesh.h"
#include "app/simulation.h"
#include "app/value_error.h"
#include "physics/dynamics/fixation.h"
#include "physics/dynamics/link_mechanics.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/model/node_volumes.h"
#include "physics/sort_unique.h"
#include "render/renderer.h"

namespace medulla {

// What says where nodes or links are looked for.
static const std::vector<std::string_view> kRegions{"box", "sphere", "plane"};

// A missing file is the scene's mistake.
static void requireFile(const Scene& scene, const ElementPlace& at, const std::string& attribute,
                        const std::string& what, const std::string& path) {
  if (!fileExists(path))
    throw valueError(scene, at, {attribute}, fmt::format("{} {} does not exist", what, inQuotes(path, '"')));
}

// As the build's command line says it.
static std::string fixText(const NodeChoice& choice) {
  if (choice.verticesPath.empty()) return regionText(choice.region);
  return "vertices=" + std::filesystem::absolute(choice.verticesPath).string();
}

// That of the model's own, identified for this body; run where the mesh lies, as that was, which need not be where the
// model does.
static std::string identifyingCommand(const SceneBody& body) {
  const std::string& settings = body.model->settings;
  std::string out = settings.substr(0, settings.find(" --identify"));
  out += fmt::format(" --identify --poisson {}", body.tissue.poisson);
  const std::string form = " --link-form ";
  if (const std::size_t at = settings.find(form); at != std::string::npos)
    out += settings.substr(at, settings.find(' ', at + form.size()) - at);
  for (const SceneFix& fix : body.fixes) out += fmt::format(" --fix {}", shellWord(fixText(fix.nodes)));
  return out + " -o " + shellWord(std::filesystem::absolute(body.modelPath).string());
}

static std::vector<int> findNodes(const Scene& scene, const ElementPlace& at, const NodeChoice& choice,
                                  const SceneBody& body) {
  if (!choice.verticesPath.empty()) {
    requireFile(scene, at, "vertices", "list of vertices", choice.verticesPath);
    return readVertices(choice.verticesPath, *body.model);
  }
  std::vector<int> nodes = nodesInRegion(*body.model, choice.region);
  if (nodes.empty())
    throw valueError(scene, at, kRegions, fmt::format("no surface node of body \"{}\" lies in here", body.name));
  return nodes;
}

// Patches of an identified model hold it, and no spheres.
static void resolvePatches(const Scene& scene, SceneBody& body) {
  const SoftBodyModel& model = *body.model;
  std::vector<std::vector<int>> asked, known;
  for (const SceneFix& fix : body.fixes) {
    if (fix.freedom != FixedFreedom::all)
      throw valueError(scene, fix.place, {"dof"},
                       fmt::format("body \"{}\" has identified links, which its patches hold wholly: expected "
                                   "dof=\"all\"",
                                   body.name));
    asked.push_back(findNodes(scene, fix.place, fix.nodes, body));
    std::sort(asked.back().begin(), asked.back().end());
    body.fixedNodes.insert(body.fixedNodes.end(), asked.back().begin(), asked.back().end());
  }
  if (!body.fixed.empty())
    throw valueError(scene, body.place, {"links"},
                     fmt::format("body \"{}\" has identified links and fixes spheres by number: expected parts of its "
                                 "surface",
                                 body.name));
  if (model.identified)
    for (const FixedPatch& patch : model.identified->patches) known.push_back(patch.nodes);
  std::sort(asked.begin(), asked.end());
  std::sort(known.begin(), known.end());
  if (model.identified && asked == known && std::abs(model.identified->poisson - body.tissue.poisson) < 1e-9) return;
  const bool byTissue = overriddenAt(scene, body.tissuePlace, {"poisson"}) != nullptr;
  throw valueError(
      scene, byTissue ? body.tissuePlace : body.place, {"links", "model", "tissue", "poisson"},
      fmt::format("body \"{}\" has identified links, and its model {}; run where its mesh lies, this would make it: {}",
                  body.name,
                  !model.identified ? "has none"
                  : asked != known
                      ? "was identified with another part of its surface fixed"
                      : fmt::format("was identified for a Poisson's ratio of {}", model.identified->poisson),
                  identifyingCommand(body)));
}

static void fixSphere(SceneBody& body, int sphere, FixedFreedom freedom) {
  const auto known =
      std::find_if(body.fixed.begin(), body.fixed.end(), [sphere](const FixedSphere& f) { return f.sphere == sphere; });
  if (known == body.fixed.end())
    body.fixed.push_back({sphere, freedom});
  else if (freedom == FixedFreedom::all)
    known->freedom = freedom;
}

// The nodes of a skin follow their spheres: a part that lets no sphere be held, neither alone nor beside the others,
// would do nothing.
static void requireHeldSkin(const Scene& scene, const SceneBody& body, const std::vector<std::vector<int>>& parts) {
  if (body.surface != SurfaceMode::skin) return;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    std::vector<int> others;
    for (std::size_t e = 0; e < parts.size(); ++e)
      if (e != k) others.insert(others.end(), parts[e].begin(), parts[e].end());
    sortUnique(others);
    const std::vector<int> held = spheresHeldBy(*body.model, parts[k]);
    if (!held.empty() || spheresHeldBy(*body.model, others) != spheresHeldBy(*body.model, body.fixedNodes)) continue;
    const bool bySurface = overriddenAt(scene, body.place, {"surface"}) != nullptr;
    throw valueError(scene, bySurface ? body.place : body.fixes[k].place,
                     {"surface", "box", "sphere", "plane", "vertices"},
                     fmt::format("nothing of body \"{}\" is held in here: its surface is a skin, and no filling sphere "
                                 "has half of its surface there; expected more of it, or spheres by number",
                                 body.name));
  }
}

// Nodes that are fixed, and the spheres that all of them together hold: regions that meet on a sphere hold it as one
// that spans both would. It turns unless those hold it alone that let nothing turn.
static void resolveFixes(const Scene& scene, SceneBody& body) {
  const SoftBodyModel& model = *body.model;
  if (body.links == LinkModel::identified) {
    resolvePatches(scene, body);
    if (!model.identified->usesFormulas) {
      for (const int sphere : model.identified->heldFrames) body.fixed.push_back({sphere});
      return;
    }
    body.links = LinkModel::beam;
    body.fixedNodes.clear();
  }
  std::vector<int> whollyHeld;
  std::vector<std::vector<int>> parts;
  for (const SceneFix& fix : body.fixes) {
    const std::vector<int>& nodes = parts.emplace_back(findNodes(scene, fix.place, fix.nodes, body));
    body.fixedNodes.insert(body.fixedNodes.end(), nodes.begin(), nodes.end());
    if (fix.freedom == FixedFreedom::all) whollyHeld.insert(whollyHeld.end(), nodes.begin(), nodes.end());
  }
  sortUnique(body.fixedNodes);
  sortUnique(whollyHeld);
  for (const int sphere : spheresHeldBy(model, body.fixedNodes)) fixSphere(body, sphere, FixedFreedom::translation);
  for (const int sphere : spheresHeldBy(model, whollyHeld)) fixSphere(body, sphere, FixedFreedom::all);
  requireHeldSkin(scene, body, parts);
}

// Of those fixed by number the file alone tells.
static void requireDrivenFree(const Scene& scene, const SceneBody& body) {
  for (std::size_t k = 0; k < body.driven.size(); ++k)
    for (const FixedSphere& fixed : body.fixed)
      if (fixed.sphere == body.driven[k].sphere)
        throw valueError(
            scene, body.drivenAt[k], {"sphere"},
            fmt::format("body \"{}\" drives sphere {}, which a <fix> of its surface holds: expected one of the two",
                        body.name, fixed.sphere));
}

static void requireSteeredLinks(const Scene& scene, const SceneBody& body) {
  const std::vector<Eigen::Vector3d> middles = linkMiddles(body);
  for (std::size_t k = 0; k < body.steered.size(); ++k) {
    const std::optional<Region>& where = body.steered[k].where;
    const auto lies = [&](const Eigen::Vector3d& middle) { return contains(*where, middle); };
    if (where && std::none_of(middles.begin(), middles.end(), lies))
      throw valueError(scene, body.steeredAt[k], kRegions,
                       fmt::format("no link of body \"{}\" has its middle in here", body.name));
  }
}

static void resolveLoads(const Scene& scene, SceneBody& body) {
  const SoftBodyModel& model = *body.model;
  const std::set<int> held(body.fixedNodes.begin(), body.fixedNodes.end());  // patches stand one after the other
  for (SceneLoad& load : body.loads) {
    if (!load.forcesPath.empty()) requireFile(scene, load.place, "file", "file of forces", load.forcesPath);
    const std::vector<DeadLoad> loads =
        load.forcesPath.empty() ? spreadLoad(model, findNodes(scene, load.place, load.nodes, body), load.whole)
                                : readVertexForces(load.forcesPath, model, load.whole);
    body.deadLoads.insert(body.deadLoads.end(), loads.begin(), loads.end());
    load.isIdle = holdsByNodes(body) &&
                  std::all_of(loads.begin(), loads.end(), [&](const DeadLoad& l) { return held.count(l.node) > 0; });
  }
}

static Reference loadReference(const Scene& scene, const SceneBody& body) {
  if (body.referencePath.empty()) return {};
  requireFile(scene, body.place, "reference", "reference", body.referencePath);
  return readReference(body.referencePath, *body.model);
}

static void requireSphere(const Scene& scene, const SceneBody& body, const ElementPlace& at,
                          const std::string& attribute, const char* verb, int sphere) {
  const int spheres = static_cast<int>(body.model->spheres.size());
  if (sphere >= spheres)
    throw valueError(
        scene, at, {attribute},
        fmt::format("body \"{}\" {} sphere {}, its model has spheres 0 to {}", body.name, verb, sphere, spheres - 1));
}

static void loadModels(Scene& scene) {
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    SceneBody& body = scene.bodies[b];
    const bool isSkin = body.surface == SurfaceMode::skin;
    for (std::size_t e = 0; e < b && !body.model; ++e)
      if (scene.bodies[e].modelPath == body.modelPath && (scene.bodies[e].surface == SurfaceMode::skin) == isSkin)
        body.model = scene.bodies[e].model;
    if (!body.model) {
      requireFile(scene, body.place, "model", fmt::format("model of body \"{}\"", body.name), body.modelPath);
      SoftBodyModel model = readModel(body.modelPath);
      if (isSkin) model = withoutNodeVolumes(model);
      body.model = std::make_shared<const SoftBodyModel>(std::move(model));
    }
    for (std::size_t k = 0; k < body.fixed.size(); ++k)
      requireSphere(scene, body, body.fixedAt[k], "spheres", "fixes", body.fixed[k].sphere);
    for (std::size_t k = 0; k < body.driven.size(); ++k)
      requireSphere(scene, body, body.drivenAt[k], "sphere", "drives", body.driven[k].sphere);
  }
}

// Known looks are the renderer's, but a run without pictures should not accept what a run with pictures refuses.
static void requireLook(const Scene& scene, const ElementPlace& at, const std::string& look) {
  const std::vector<std::string> known = lookNames();
  if (isOneOf(look, known)) return;
  throw valueError(scene, at, {"look"},
                   fmt::format("unknown look {}: {}", inQuotes(look, '"'), hintOfNames(look, known)));
}

static Trajectory loadTrajectory(const Scene& scene, SceneTool& tool) {
  if (tool.place.line > 0)
    requireFile(scene, tool.place, "trajectory", fmt::format("trajectory of tool \"{}\"", tool.name),
                tool.trajectoryPath);
  if (!isRecording(tool.trajectoryPath)) return readTrajectory(tool.trajectoryPath);
  const RecordingMap map = readRecordingMap(tool.trajectoryPath);
  tool.recordingPath = map.recordingPath;
  return readRecording(map);
}

// Of the mesh file's shape, which single precision draws and asks for contacts.
static void requireNearby(const Scene& scene, const SceneStatic& item, const TriangleMesh& mesh) {
  double most = 0;
  for (const Eigen::Vector3d& x : mesh.vertices) most = std::max(most, x.lpNorm<Eigen::Infinity>());
  if (most <= kAnyPlace.most) return;
  throw valueError(scene, item.place, {"mesh", "unit"},
                   fmt::format("{} reaches {:.3g} m from its origin, expected at most {} m; is its unit right?",
                               item.meshPath, most, kAnyPlace.most));
}

double sizeOfBodies(const Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const SceneBody& body : scene.bodies)
    for (const Eigen::Vector3d& x : body.model->restNodes) box.extend(body.worldFromModel * x);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

LoadedScene loadScene(Scene scene, const std::map<std::string, std::string>& trajectories) {
  LoadedScene loaded;
  for (SceneTool& tool : scene.tools) {
    const auto other = trajectories.find(tool.name);
    if (other == trajectories.end()) continue;
    tool.trajectoryPath = other->second;
    tool.place = {};
  }
  for (const SceneBody& body : scene.bodies) requireLook(scene, body.place, body.look);
  loadModels(scene);
  for (SceneBody& body : scene.bodies) {
    resolveFixes(scene, body);
    requireDrivenFree(scene, body);
    requireSteeredLinks(scene, body);
    resolveLoads(scene, body);
    loaded.references.push_back(loadReference(scene, body));
  }
  const double size = sizeOfBodies(scene);
  for (const SceneStatic& item : scene.statics) {
    if (!item.look.empty()) requireLook(scene, item.place, item.look);
    if (!item.meshPath.empty()) requireFile(scene, item.place, "mesh", "mesh", item.meshPath);
    loaded.statics.push_back(item.meshPath.empty() ? shapeMesh(item.shape, size)
                                                   : readMesh(item.meshPath, metresPerUnit(item.unit)));
    if (!item.meshPath.empty()) requireNearby(scene, item, loaded.statics.back());
  }
  for (SceneTool& tool : scene.tools) loaded.trajectories.push_back(loadTrajectory(scene, tool));
  loaded.scene = std::move(scene);
  return loaded;
}

}  // namespace medulla
