#include "app/scene_view.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "app/model_drawing.h"
#include "haptics/monotone_cubic.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/model/disjoint_sets.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

glm::vec3 toGlm(const Eigen::Vector3d& v) {
  return {float(v.x()), float(v.y()), float(v.z())};
}

static glm::quat toGlm(const Eigen::Quaterniond& q) {
  return {float(q.w()), float(q.x()), float(q.y()), float(q.z())};
}

namespace {

SurfaceShape shapeOf(const std::vector<std::array<int, 3>>& triangles, const std::string& look) {
  SurfaceShape shape;
  shape.look = look;
  for (const auto& t : triangles) shape.triangles.push_back({unsigned(t[0]), unsigned(t[1]), unsigned(t[2])});
  return shape;
}

// Triangles that meet at a sharp edge get corners of their own there: normals are those of vertices, and light would
// run round a table's edge as round a ball.
TriangleMesh creased(TriangleMesh mesh) {
  constexpr double kSmooth = 0.34;  // cosine of 70 degrees: folds of organs are drawn by fewer triangles than that
  std::vector<Eigen::Vector3d> normal;
  std::vector<std::vector<int>> around(mesh.vertices.size());  // triangles
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    normal.push_back(areaVector(mesh, mesh.triangles[t]).normalized());
    for (const int v : mesh.triangles[t]) around[v].push_back(static_cast<int>(t));
  }
  const std::vector<std::array<int, 3>> triangles = mesh.triangles;
  const auto share = [&](int t, int u) {  // an edge, by the vertex that both have
    return std::count_if(triangles[t].begin(), triangles[t].end(), [&](int v) {
             return std::find(triangles[u].begin(), triangles[u].end(), v) != triangles[u].end();
           }) > 1;
  };
  const auto isSmooth = [&](int t, int u) {  // what has no area says nothing
    return normal[t].isZero() || normal[u].isZero() || normal[t].dot(normal[u]) > kSmooth;
  };
  for (std::size_t v = 0; v < around.size(); ++v) {
    const std::vector<int>& fan = around[v];
    DisjointSets smooth(fan.size());
    for (std::size_t i = 0; i < fan.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (isSmooth(fan[i], fan[j]) && share(fan[i], fan[j])) smooth.join(static_cast<int>(i), static_cast<int>(j));
    std::map<int, int> corner{{0, static_cast<int>(v)}};
    for (std::size_t i = 0; i < fan.size(); ++i) {
      const auto [at, isNew] =
          corner.try_emplace(smooth.of(static_cast<int>(i)), static_cast<int>(mesh.vertices.size()));
      if (isNew) mesh.vertices.push_back(Eigen::Vector3d(mesh.vertices[v]));
      std::replace(mesh.triangles[fan[i]].begin(), mesh.triangles[fan[i]].end(), static_cast<int>(v), at->second);
    }
  }
  return mesh;
}

SurfaceShape shapeOf(const TriangleMesh& smooth, const Eigen::Isometry3d& worldFromMesh, const std::string& look) {
  const TriangleMesh mesh = creased(smooth);
  SurfaceShape shape = shapeOf(mesh.triangles, look);
  for (const Eigen::Vector3d& v : mesh.vertices) shape.restPositions.push_back(toGlm(worldFromMesh * v));
  return shape;
}

void drawnPositions(const SceneBody& body, const SurfaceSmoothing& smoothing, const std::vector<Eigen::Vector3d>& nodes,
                    std::vector<glm::vec3>& out) {
  const RenderSurface& surface = body.model->renderSurface;
  if (smoothing.share.empty()) return evaluateRenderSurface(surface, nodes, out);
  // A state cache keeps nodes as floats: what is drawn of it shall not differ.
  std::vector<Eigen::Vector3d> single;
  single.reserve(nodes.size());
  for (const Eigen::Vector3d& node : nodes) single.emplace_back(node.cast<float>().cast<double>());
  evaluateRenderSurface(surface, smoothed(smoothing, single), out);
}

// The filling spheres' balls.
void ballsOf(const SoftBodyModel& model, const BodyFrame& frame, std::vector<ShadeBall>& out) {
  out.clear();
  for (std::size_t i = 0; i < model.spheres.size(); ++i) {
    const FillingSphere& sphere = model.spheres[i];
    out.push_back({toGlm(ballCentre(sphere, frame.spheres[i])), float(sphere.radius)});
  }
}

void addTool(const SceneTool& tool, const ToolSample& input, const ToolState& state, Picture& picture) {
  Instrument instrument;
  instrument.worldFromTool = toGlm(input.worldFromTool);
  // Instruments are 5 mm across whatever sphere feels for them; beside bodies that are no organs they are in
  // proportion.
  constexpr double kThinnest = 1.5e-3, kThickest = 7e-3;  // m
  instrument.scale = float(tool.settings.radius / std::clamp(tool.settings.radius, kThinnest, kThickest));

  // Where a grip closes the jaws meet tissue and hold it. Over the grip's last part, a few pictures long, they close
  // on it and it rises between them: it would jump into and out of the jaws else. Firm jaws stand half a millimetre
  // apart at their tips: what lies between is thinner than that farther in, and would seem to be nothing.
  constexpr double kFirm = 0.95;
  const double firm = std::clamp((input.grip - kGripCloses) / (kFirm - kGripCloses), 0.0, 1.0);
  constexpr double kOpenJaw = 0.38, kHoldingJaw = 0.11, kClosedJaw = 0.012;  // rad
  const double closed = std::min(input.grip / kGripCloses, 1.0);
  instrument.jawAngle = float(kOpenJaw + (kHoldingJaw - kOpenJaw) * closed + (kClosedJaw - kHoldingJaw) * firm);
  instrument.hold = float(state.grasp * firm * firm * (3 - 2 * firm));
  instrument.grasp = float(state.grasp);
  // A dent as deep as Hertz's contact has it for a tip of 3 mm in tissue of some 10 kPa, up to what stays a dent.
  constexpr double kDeepest = 4e-3, kSoft = 0.15;  // m, at scale 1; N
  // What a grip holds does not give way.
  const double force = state.steadyForce.norm();
  const double deep = kDeepest * instrument.scale * (1 - std::exp(-force / kSoft)) * (1 - state.grasp);
  if (force > 0) instrument.press = toGlm(-deep / force * state.steadyForce);
  constexpr double kShown = 1e-6;  // m
  instrument.touching = deep > kShown || state.grasp > 1e-3;
  // The picture shows the proxy: an instrument never enters the tissue, its device may. What holds is drawn where the
  // hand is: its proxy hangs on the tissue, and the instrument would jump when it lets go. The proxy is a sphere, the
  // jaws reach to its far side along the shaft.
  const Eigen::Vector3d centre = state.proxy + state.grasp * (state.device - state.proxy);
  instrument.tip =
      toGlm(centre - tool.settings.radius * (input.worldFromTool * Eigen::Vector3d::UnitZ())) + instrument.press;
  picture.instruments.push_back(instrument);
}

Light lightOf(const Scene& scene) {
  Light light;
  light.offset = toGlm(scene.lightOffset);
  if (scene.lightPosition) light.position = toGlm(*scene.lightPosition);
  light.intensity = float(scene.lightIntensity);
  light.referenceDistance = float(scene.lightReferenceDistance);
  if (scene.haze) light.haze = Haze{toGlm(*scene.haze), float(scene.hazeDistance)};
  light.caustics = float(scene.caustics);
  return light;
}

}  // namespace

void evaluateRenderSurface(const RenderSurface& surface, const std::vector<Eigen::Vector3d>& nodes,
                           std::vector<glm::vec3>& out) {
  const std::size_t count = surface.first.empty() ? 0 : surface.first.size() - 1;
  out.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    glm::vec3 x(0), a(0), b(0);
    for (int s = surface.first[k]; s < surface.first[k + 1]; ++s) {
      const glm::vec3 node = toGlm(nodes[surface.node[s]]);
      x += surface.weight[s] * node;
      a += surface.tangent0[s] * node;
      b += surface.tangent1[s] * node;
    }
    const auto& o = surface.offset[k];
    if (o[0] != 0 || o[1] != 0 || o[2] != 0) {
      const glm::vec3 t0 = glm::normalize(a), n = glm::normalize(glm::cross(a, b));
      x += o[0] * t0 + o[1] * glm::cross(n, t0) + o[2] * n;
    }
    out[k] = x;
  }
}

Camera cameraAt(const std::vector<CameraKey>& keys, double time) {
  std::size_t k = 0;
  while (k + 1 < keys.size() && keys[k + 1].time <= time) ++k;
  CameraKey at = keys[k];
  if (k + 1 < keys.size() && time > at.time) {
    const double s = (time - at.time) / (keys[k + 1].time - at.time);
    const auto through = [&](const auto& value) { return cubicThrough(keys, k, s, value); };
    at.position = through([](const CameraKey& key) { return key.position; });
    at.target = through([](const CameraKey& key) { return key.target; });
    at.fovDegrees = through([](const CameraKey& key) { return Eigen::Vector3d(key.fovDegrees, 0, 0); }).x();
  }
  Camera camera;
  camera.position = toGlm(at.position);
  camera.target = toGlm(at.target);
  camera.fovDegrees = float(at.fovDegrees);
  return camera;
}

float heightAtTarget(const Camera& camera) {
  return 2 * glm::length(camera.target - camera.position) * std::tan(0.5f * glm::radians(camera.fovDegrees));
}

SceneView::SceneView(const LoadedScene& loaded, const DynamicsFrame& rest, Renderer& renderer)
    : loaded_(&loaded), widening_(widening(renderer.aspect())) {
  const Scene& scene = loaded.scene;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SceneBody& body = scene.bodies[b];
    smoothings_.push_back(body.links == LinkModel::identified ? SurfaceSmoothing{} : makeSurfaceSmoothing(*body.model));
    SurfaceShape shape = shapeOf(body.model->renderSurface.triangles, body.look);
    drawnPositions(body, smoothings_[b], rest.bodies[b].nodes, shape.restPositions);
    ballsOf(*body.model, rest.bodies[b], shape.restBalls);
    shape.travels = !isHeld(body);
    renderer.addSurface(std::move(shape));
  }
  for (std::size_t s = 0; s < scene.statics.size(); ++s) {
    const SceneStatic& item = scene.statics[s];
    if (item.look.empty()) continue;
    renderer.addSurface(shapeOf(loaded.statics[s], item.shape.worldFromShape, item.look));
    ++drawnStatics_;
  }
}

void SceneView::compose(const PictureState& state, ViewKind view, const Shown& shown, Picture& picture) const {
  const Scene& scene = loaded_->scene;
  picture.view = view;
  picture.camera = cameraAt(scene.camera, state.time);
  const float height =
      heightAtTarget(picture.camera);  // not as a tall picture widens it: lines would be as much thicker
  if (widening_ > 1)
    picture.camera.fovDegrees =
        glm::degrees(2 * std::atan(widening_ * std::tan(0.5f * glm::radians(picture.camera.fovDegrees))));
  picture.light = lightOf(scene);
  picture.endoscopeMask = scene.endoscope;
  picture.time = float(state.time);
  picture.instruments.clear();
  picture.model.clear();
  picture.overlay.clear();
  picture.surfaces.resize(scene.bodies.size() + drawnStatics_);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const BodyFrame& frame = state.frame.bodies[b];
    drawnPositions(scene.bodies[b], smoothings_[b], frame.nodes, picture.surfaces[b].positions);
    ballsOf(*scene.bodies[b].model, frame, picture.surfaces[b].balls);
    if (view != ViewKind::tissue) drawBodyModel(scene.bodies[b], frame, shown, height, picture.model);
  }
  for (std::size_t k = 0; k < scene.tools.size(); ++k) {
    addTool(scene.tools[k], state.inputs[k], state.tools[k], picture);
    if (shown.proxy) drawProxy(scene.tools[k].settings, state.tools[k], picture.overlay);
  }
}

}  // namespace medulla
