#include "app/scene_view.h"

#include <algorithm>
#include <cmath>

#include "app/files/input_error.h"
#include "haptics/monotone_cubic.h"

namespace medulla {

glm::vec3 toGlm(const Eigen::Vector3d& v) {
  return {float(v.x()), float(v.y()), float(v.z())};
}

glm::quat toGlm(const Eigen::Quaterniond& q) {
  return {float(q.w()), float(q.x()), float(q.y()), float(q.z())};
}

namespace {

// Colours of the model view, linear RGB: after the paper's figures, told apart by brightness too.
constexpr glm::vec4 kBallColour{0.80f, 0.30f, 0.22f, 0.55f};
constexpr glm::vec4 kFixedBallColour{0.30f, 0.32f, 0.36f, 0.70f};
constexpr glm::vec4 kLinkColour{0.95f, 0.75f, 0.20f, 1};
constexpr glm::vec4 kAttachmentColour{0.25f, 0.55f, 0.80f, 1};
constexpr glm::vec4 kSkeletonColour{0.10f, 0.11f, 0.13f, 1};
constexpr glm::vec4 kAxisColours[3] = {{0.85f, 0.15f, 0.12f, 1}, {0.15f, 0.65f, 0.15f, 1}, {0.15f, 0.30f, 0.90f, 1}};
constexpr glm::vec4 kProxyColour{0.15f, 0.75f, 0.25f, 0.9f};
constexpr glm::vec4 kDeviceColour{0.95f, 0.20f, 0.85f, 0.9f};

SurfaceShape shapeOf(const TriangleMesh& mesh, const Eigen::Isometry3d& worldFromMesh, const std::string& look) {
  SurfaceShape shape;
  shape.look = look;
  for (const Eigen::Vector3d& v : mesh.vertices) shape.restPositions.push_back(toGlm(worldFromMesh * v));
  for (const auto& t : mesh.triangles) shape.triangles.push_back({unsigned(t[0]), unsigned(t[1]), unsigned(t[2])});
  return shape;
}

SurfaceShape shapeOf(const RenderSurface& surface, const std::vector<Eigen::Vector3d>& nodes, const std::string& look) {
  SurfaceShape shape;
  shape.look = look;
  evaluateRenderSurface(surface, nodes, shape.restPositions);
  for (const auto& t : surface.triangles) shape.triangles.push_back({unsigned(t[0]), unsigned(t[1]), unsigned(t[2])});
  return shape;
}

Eigen::Vector3d anchorOf(const SoftBodyModel& model, const BodyFrame& frame, const Attachment& attachment) {
  if (!attachment.onLink) return frame.spheres[attachment.host].position;
  const ElasticLink& link = model.links[attachment.host];
  return blendPoint(frame.spheres[link.sphere0].position, frame.spheres[link.sphere1].position, attachment.along);
}

// The raw skeleton is not simulated: each of its nodes rides on the sphere nearest to it at rest.
Eigen::Vector3d carriedBySphere(const SoftBodyModel& model, const BodyFrame& frame, const Eigen::Vector3d& rest) {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < model.spheres.size(); ++i) {
    const double distance = (model.spheres[i].restFrame - rest).squaredNorm();
    if (distance < (model.spheres[nearest].restFrame - rest).squaredNorm()) nearest = i;
  }
  const SpherePose& pose = frame.spheres[nearest];
  return pose.position + pose.worldFromSphere * (rest - model.spheres[nearest].restFrame);
}

void addSkeleton(const SoftBodyModel& model, const BodyFrame& frame, Picture& picture) {
  std::vector<glm::vec3> nodes;
  for (const Eigen::Vector3d& rest : model.skeleton.nodes) {
    nodes.push_back(toGlm(carriedBySphere(model, frame, rest)));
    picture.balls.push_back({nodes.back(), 0.0010f, kSkeletonColour});
  }
  for (const auto& [a, b] : model.skeleton.links)
    picture.segments.push_back({nodes[a], nodes[b], 0.0004f, kSkeletonColour});
}

// Spheres with their frames, links and attachments: the paper's figures 2, 10 and 11.
void addModel(const SceneBody& body, const SoftBodyModel& model, const BodyFrame& frame, Picture& picture) {
  for (std::size_t i = 0; i < model.spheres.size(); ++i) {
    const FillingSphere& sphere = model.spheres[i];
    const SpherePose& pose = frame.spheres[i];
    const Eigen::Matrix3d worldFromSphere = pose.worldFromSphere.toRotationMatrix();
    const Eigen::Vector3d centre = pose.position + worldFromSphere * (sphere.restBallCentre - sphere.restFrame);
    const bool fixed = std::any_of(body.fixed.begin(), body.fixed.end(),
                                   [&](const FixedSphere& f) { return f.sphere == static_cast<int>(i); });
    picture.balls.push_back({toGlm(centre), float(sphere.radius), fixed ? kFixedBallColour : kBallColour});
    const float axis = 0.6f * float(sphere.radius), thin = 0.035f * float(sphere.radius);
    for (int a = 0; a < 3; ++a)
      picture.segments.push_back(
          {toGlm(pose.position), toGlm(pose.position) + axis * toGlm(worldFromSphere.col(a)), thin, kAxisColours[a]});
  }
  for (const ElasticLink& link : model.links) {
    const float radius =
        0.08f * float(std::min(model.spheres[link.sphere0].radius, model.spheres[link.sphere1].radius));
    picture.segments.push_back({toGlm(frame.spheres[link.sphere0].position),
                                toGlm(frame.spheres[link.sphere1].position), std::max(radius, 0.0004f), kLinkColour});
  }
  for (std::size_t n = 0; n < model.attachments.size(); ++n) {
    picture.segments.push_back(
        {toGlm(anchorOf(model, frame, model.attachments[n])), toGlm(frame.nodes[n]), 0.00010f, kAttachmentColour});
    picture.balls.push_back({toGlm(frame.nodes[n]), 0.0005f, kAttachmentColour});
  }
}

void addTool(const SceneTool& tool, const ToolSample& input, const ToolState& state, const ViewOptions& options,
             Picture& picture) {
  Instrument instrument;
  // The picture shows the proxy: an instrument never enters the tissue, its device may. The proxy is a sphere, the jaws
  // reach to its far side along the shaft.
  instrument.tip = toGlm(state.proxy - tool.settings.radius * (input.worldFromTool * Eigen::Vector3d::UnitZ()));
  instrument.worldFromTool = toGlm(input.worldFromTool);
  // A grip of 0.5 is where the jaws meet tissue and hold it.
  constexpr double kOpenJaw = 0.38, kClosedJaw = 0.03;  // rad
  instrument.jawAngle = float(kClosedJaw + (kOpenJaw - kClosedJaw) * std::max(0.0, 1 - 2 * input.grip));
  instrument.touching = state.inContact || state.holding;
  instrument.holding = state.holding;
  picture.instruments.push_back(instrument);
  if (!options.showProxy) return;
  picture.balls.push_back({toGlm(state.proxy), float(tool.settings.radius), kProxyColour});
  picture.balls.push_back({toGlm(state.device), 0.6f * float(tool.settings.radius), kDeviceColour});
  picture.segments.push_back({toGlm(state.device), toGlm(state.proxy), 0.0004f, kDeviceColour});
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

SceneView::SceneView(const LoadedScene& loaded, const DynamicsFrame& rest, Renderer& renderer) : loaded_(&loaded) {
  const Scene& scene = loaded.scene;
  const auto add = [&](int line, SurfaceShape shape) {
    try {
      renderer.addSurface(std::move(shape));
    } catch (const std::runtime_error& error) {
      throw inputError(scene.path, line, error.what());
    }
  };
  for (std::size_t b = 0; b < scene.bodies.size(); ++b)
    add(scene.bodies[b].line, shapeOf(loaded.models[b]->renderSurface, rest.bodies[b].nodes, scene.bodies[b].look));
  for (std::size_t s = 0; s < scene.statics.size(); ++s) {
    const SceneStatic& item = scene.statics[s];
    if (item.look.empty()) continue;
    add(item.line, shapeOf(loaded.statics[s], item.shape.worldFromShape, item.look));
    ++drawnStatics_;
  }
}

void SceneView::compose(const PictureState& state, const ViewOptions& options, Picture& picture) const {
  const Scene& scene = loaded_->scene;
  picture.view = options.view;
  picture.camera = cameraAt(scene.camera, state.time);
  picture.light = lightOf(scene);
  picture.endoscopeMask = scene.endoscope;
  picture.time = float(state.time);
  picture.instruments.clear();
  picture.balls.clear();
  picture.segments.clear();
  picture.surfaces.resize(scene.bodies.size() + drawnStatics_);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const BodyFrame& frame = state.frame.bodies[b];
    evaluateRenderSurface(loaded_->models[b]->renderSurface, frame.nodes, picture.surfaces[b].positions);
    if (options.view == ViewKind::tissue) continue;
    addModel(scene.bodies[b], *loaded_->models[b], frame, picture);
    addSkeleton(*loaded_->models[b], frame, picture);
  }
  for (std::size_t k = 0; k < scene.tools.size(); ++k)
    addTool(scene.tools[k], state.inputs[k], state.tools[k], options, picture);
}

}  // namespace medulla
