#include "app/model_drawing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/scene_view.h"
#include "physics/model/attachment.h"
#include "render/across.h"
#include "render/looks.h"

namespace medulla {

namespace {

using Eigen::Vector3d;

// Linear RGB: told apart by brightness too.
constexpr glm::vec4 kMeshColour{0.42f, 0.45f, 0.50f, 1};
constexpr glm::vec4 kSkeletonColour{0.10f, 0.11f, 0.13f, 1};
constexpr glm::vec4 kSphereColour{0.80f, 0.30f, 0.22f, 0.50f};
constexpr glm::vec4 kFixedSphereColour{0.30f, 0.32f, 0.36f, 0.65f};
constexpr glm::vec4 kBucketColour{0.45f, 0.30f, 0.80f, 0.10f};
constexpr glm::vec4 kLinkColour{1.00f, 0.60f, 0.02f, 1};
constexpr glm::vec4 kAttachmentColour{0.16f, 0.45f, 0.75f, 1};
constexpr glm::vec4 kFrameColours[3] = {
    {0.80f, 0.08f, 0.06f, 1}, {0.08f, 0.55f, 0.10f, 1}, {0.10f, 0.22f, 0.90f, 1}};  // t, u, v
constexpr glm::vec4 kProxyColour{0.15f, 0.75f, 0.25f, 0.35f};
constexpr glm::vec4 kDeviceColour{0.95f, 0.20f, 0.85f, 1};

// Of the picture's height.
constexpr float kThin = 0.0008f, kNode = 0.0024f, kBone = 0.0016f, kJoint = 0.0045f, kLink = 0.0050f;

// A link's ends as its spheres carry them, and the frames there (paper, figure 3): columns t, u, v.
struct CarriedLink {
  Vector3d end[2];
  Eigen::Matrix3d worldFromLink[2];
  Vector3d bow = Vector3d::Zero();  // m, of beams: across the chord
  double radius = 0;                // m, of the smaller sphere

  // A beam is bent by the slopes of its ends, as the dynamics carries what hangs on it.
  Vector3d at(double along) const { return blendPoint(end[0], end[1], along) + 0.5 * along * (1 - along) * bow; }
};

// A point of the model at rest, as its sphere carries it.
Vector3d carriedPoint(const FillingSphere& sphere, const SpherePose& pose, const Vector3d& rest) {
  return pose.position + pose.worldFromSphere * (rest - sphere.restFrame);
}

CarriedLink carriedLink(const BodyDescription& body, const BodyFrame& frame, const ElasticLink& link) {
  const SoftBodyModel& model = *body.model;
  const FillingSphere* spheres[] = {&model.spheres[link.sphere0], &model.spheres[link.sphere1]};
  const SpherePose* poses[] = {&frame.spheres[link.sphere0], &frame.spheres[link.sphere1]};
  Eigen::Matrix3d rest;
  rest.col(0) = (spheres[1]->restLinkEnd - spheres[0]->restLinkEnd).normalized();
  rest.col(1) = link.restU;
  rest.col(2) = rest.col(0).cross(rest.col(1));
  CarriedLink out;
  for (int k = 0; k < 2; ++k) {
    out.end[k] = carriedPoint(*spheres[k], *poses[k], spheres[k]->restLinkEnd);
    out.worldFromLink[k] = poses[k]->worldFromSphere * rest;
  }
  out.radius = std::min(spheres[0]->radius, spheres[1]->radius);
  if (body.links != LinkModel::beam) return out;
  const Vector3d line = out.end[1] - out.end[0];
  const Vector3d slopes = out.worldFromLink[0].col(0) - out.worldFromLink[1].col(0);
  out.bow = line.norm() * slopes - slopes.dot(line) / line.norm() * line;
  return out;
}

// Between the centres of two cells, or of one and where what holds it lies.
CarriedLink carriedLink(const BodyDescription& body, const BodyFrame& frame, const IdentifiedLink& link) {
  const SoftBodyModel& model = *body.model;
  CarriedLink out;
  out.radius = model.spheres[link.frame0].radius;
  const int frames[] = {link.frame0, link.frame1};
  const Vector3d* points[] = {&link.restPoint0, &link.restPoint1};
  for (int k = 0; k < 2; ++k) {
    Eigen::Matrix3d worldFromFrame = body.worldFromModel.rotation();
    out.end[k] = body.worldFromModel * *points[k];
    if (frames[k] < static_cast<int>(model.spheres.size())) {
      const FillingSphere& sphere = model.spheres[frames[k]];
      const SpherePose& pose = frame.spheres[frames[k]];
      worldFromFrame = pose.worldFromSphere.toRotationMatrix();
      out.end[k] = carriedPoint(sphere, pose, *points[k]);
      out.radius = std::min(out.radius, sphere.radius);
    }
    out.worldFromLink[k] = worldFromFrame * link.axes.transpose();
  }
  return out;
}

std::vector<CarriedLink> carriedLinks(const BodyDescription& body, const BodyFrame& frame) {
  const SoftBodyModel& model = *body.model;
  std::vector<CarriedLink> out;
  if (body.links == LinkModel::identified)
    for (const IdentifiedLink& link : model.identified->links) out.push_back(carriedLink(body, frame, link));
  else
    for (const ElasticLink& link : model.links) out.push_back(carriedLink(body, frame, link));
  return out;
}

// The raw skeleton is not simulated: each of its nodes rides on the sphere nearest to it at rest.
Vector3d carriedBySphere(const SoftBodyModel& model, const BodyFrame& frame, const Vector3d& rest) {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < model.spheres.size(); ++i) {
    const double distance = (model.spheres[i].restFrame - rest).squaredNorm();
    if (distance < (model.spheres[nearest].restFrame - rest).squaredNorm()) nearest = i;
  }
  return carriedPoint(model.spheres[nearest], frame.spheres[nearest], rest);
}

void drawSkeleton(const SoftBodyModel& model, const BodyFrame& frame, float height, Drawing& out) {
  std::vector<glm::vec3> nodes;
  for (const Vector3d& rest : model.skeleton.nodes) {
    nodes.push_back(toGlm(carriedBySphere(model, frame, rest)));
    out.balls.push_back({nodes.back(), kJoint * height, kSkeletonColour});
  }
  for (const auto& [a, b] : model.skeleton.links)
    out.segments.push_back({nodes[a], nodes[b], kBone * height, kSkeletonColour});
}

void drawMesh(const SoftBodyModel& model, const BodyFrame& frame, float height, Drawing& out) {
  for (const auto& [a, b] : model.edges)
    out.segments.push_back({toGlm(frame.nodes[a]), toGlm(frame.nodes[b]), 0.5f * kThin * height, kMeshColour});
}

void drawSpheres(const SceneBody& body, const BodyFrame& frame, Drawing& out) {
  const SoftBodyModel& model = *body.model;
  // Bodies that lie together are told apart by the hue of what they look like, for the most part: mixed half and half,
  // or as dark as wet tissue is, it would seem the grey of what is held.
  constexpr float kOwn = 0.7f;
  const Look& look = findLook(body.look);
  const glm::vec3 looks = look.albedoLow + look.albedoHigh;
  const glm::vec4 own(kSphereColour.r / std::max({looks.r, looks.g, looks.b, 1e-3f}) * looks, kSphereColour.a);
  const glm::vec4 colour = glm::mix(kSphereColour, own, kOwn);
  for (std::size_t i = 0; i < model.spheres.size(); ++i) {
    const FillingSphere& sphere = model.spheres[i];
    const Vector3d centre = ballCentre(sphere, frame.spheres[i]);
    const bool fixed = std::any_of(body.fixed.begin(), body.fixed.end(),
                                   [&](const FixedSphere& f) { return f.sphere == static_cast<int>(i); });
    out.balls.push_back({toGlm(centre), float(sphere.radius), fixed ? kFixedSphereColour : colour});
  }
}

// The second radius as haptics has it: around the middle of the box around a bucket's triangles. Measured where nodes
// are drawn, in single precision, which is all that a state cache keeps of them: its pictures are the run's.
void drawBuckets(const SoftBodyModel& model, const BodyFrame& frame, Drawing& out) {
  std::vector<glm::vec3> nodes;
  for (const std::vector<int>& bucket : model.buckets) {
    nodes.clear();
    for (const int t : bucket)
      for (const int n : model.triangles[t]) nodes.push_back(toGlm(frame.nodes[n]));
    if (nodes.empty()) continue;
    glm::vec3 low = nodes[0], high = nodes[0];
    for (const glm::vec3& x : nodes) {
      low = glm::min(low, x);
      high = glm::max(high, x);
    }
    const glm::vec3 centre = 0.5f * (low + high);
    float radius = 0;
    for (const glm::vec3& x : nodes) radius = std::max(radius, glm::distance(x, centre));
    out.balls.push_back({centre, radius, kBucketColour});
  }
}

void drawLink(const CarriedLink& link, bool bent, float radius, Drawing& out) {
  const int pieces = bent ? 8 : 1;
  for (int k = 0; k < pieces; ++k)
    out.segments.push_back(
        {toGlm(link.at(double(k) / pieces)), toGlm(link.at(double(k + 1) / pieces)), radius, kLinkColour});
  for (const Vector3d& end : link.end) out.balls.push_back({toGlm(end), 1.8f * radius, kLinkColour});
}

void drawFrames(const CarriedLink& link, float length, Drawing& out) {
  for (int end = 0; end < 2; ++end)
    for (int axis = 0; axis < 3; ++axis) {
      const glm::vec3 from = toGlm(link.end[end]), along = toGlm(Vector3d(link.worldFromLink[end].col(axis)));
      out.arrows.push_back({from, from + length * along, 0.045f * length, kFrameColours[axis]});
    }
}

}  // namespace

Eigen::Vector3d ballCentre(const FillingSphere& sphere, const SpherePose& pose) {
  return carriedPoint(sphere, pose, sphere.restBallCentre);
}

void drawBodyModel(const SceneBody& body, const BodyFrame& frame, const Shown& shown, float height, Drawing& out) {
  const SoftBodyModel& model = *body.model;
  if (shown.mesh) drawMesh(model, frame, height, out);
  if (shown.skeleton) drawSkeleton(model, frame, height, out);
  if (shown.spheres) drawSpheres(body, frame, out);
  if (shown.buckets) drawBuckets(model, frame, out);
  if (!shown.links && !shown.frames && !shown.attachments) return;
  const std::vector<CarriedLink> links = carriedLinks(body, frame);
  for (const CarriedLink& link : links) {
    if (shown.links)
      drawLink(link, body.links == LinkModel::beam, std::min(kLink * height, 0.2f * float(link.radius)), out);
    if (shown.frames) drawFrames(link, 0.7f * float(link.radius), out);
  }
  if (!shown.attachments) return;
  const std::vector<Attachment> attachments =
      body.links == LinkModel::identified ? attachmentsToFrames(model, model.identified->skin) : model.attachments;
  for (std::size_t n = 0; n < attachments.size(); ++n) {
    const Attachment& a = attachments[n];
    const Vector3d host = a.onLink ? links[a.host].at(a.along) : frame.spheres[a.host].position;
    out.segments.push_back({toGlm(host), toGlm(frame.nodes[n]), kThin * height, kAttachmentColour});
    out.balls.push_back({toGlm(frame.nodes[n]), kNode * height, kAttachmentColour});
  }
}

// A coil from a to b, as segments end to end: the first begins at a, the last ends at b, none is farther from the
// straight line than `radius`. None where a and b are one.
static std::vector<Segment> coil(glm::vec3 a, glm::vec3 b, float radius, float wire, glm::vec4 colour) {
  constexpr int kTurns = 7, kPiecesPerTurn = 16, kPieces = kTurns * kPiecesPerTurn;
  constexpr float kLead = 0.12f;  // share of the length in which the coil widens at either end
  std::vector<Segment> out;
  if (a == b) return out;
  const glm::vec3 along = b - a, w = glm::normalize(along), u = across(w), v = glm::cross(w, u);
  glm::vec3 before = a;
  for (int k = 1; k <= kPieces; ++k) {
    const float s = float(k) / kPieces, angle = 2 * std::numbers::pi_v<float> * float(k) / kPiecesPerTurn;
    const float wide = radius * glm::smoothstep(0.f, kLead, std::min(s, 1 - s));
    const glm::vec3 at = k == kPieces ? b : a + s * along + wide * (std::cos(angle) * u + std::sin(angle) * v);
    out.push_back({before, at, wire, colour});
    before = at;
  }
  return out;
}

void drawProxy(const ToolSettings& tool, const ToolState& state, Drawing& out) {
  const glm::vec3 proxy = toGlm(state.proxy), device = toGlm(state.device);
  const float radius = float(tool.radius);
  out.balls.push_back({proxy, radius, kProxyColour});
  out.balls.push_back({device, 0.3f * radius, kDeviceColour});
  const float width = std::min(0.45f * radius, glm::distance(proxy, device));
  const std::vector<Segment> spring = coil(device, proxy, width, 0.12f * width, kDeviceColour);
  out.segments.insert(out.segments.end(), spring.begin(), spring.end());
}

}  // namespace medulla
