#include "haptics/buckets.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "haptics/tool_input.h"

namespace medulla {

using Eigen::Vector3d;

// Bounds are grown beyond the sphere's radius by what float rays within toolReach can be off. Embree's ROBUST flag does
// not reach user geometry.
static constexpr double boundsFactor = 1.001, boundsMargin = 1e-5;  // -, m

namespace {
struct Bucket {
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  const BlendedSurface* surface = nullptr;
  double inflation = 0;  // m
  std::vector<int> triangles;
  std::vector<int> nodes;              // of the triangles, each once
  Vector3d centre = Vector3d::Zero();  // of the bounding sphere around both frames, not inflated
  double radius = 0;
  bool stale = false;  // the scene bounds frames older than the surface's
};
}  // namespace

struct Buckets::Data {
  RTCDevice device = nullptr;
  BlendedSurface surface;
  std::vector<Bucket> buckets;
  std::vector<int> near;

  Data() = default;
  Data(const Data&) = delete;
  Data& operator=(const Data&) = delete;
  ~Data() {
    for (Bucket& bucket : buckets) {
      if (bucket.geometry) rtcReleaseGeometry(bucket.geometry);
      if (bucket.scene) rtcReleaseScene(bucket.scene);
    }
    if (device) rtcReleaseDevice(device);
  }
};

static void triangleBounds(const RTCBoundsFunctionArguments* args) {
  const Bucket& bucket = *static_cast<const Bucket*>(args->geometryUserPtr);
  Vector3d lower = Vector3d::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (const int n : bucket.surface->triangles[bucket.triangles[args->primID]]) {
    lower = lower.cwiseMin(bucket.surface->from[n]).cwiseMin(bucket.surface->to[n]);
    upper = upper.cwiseMax(bucket.surface->from[n]).cwiseMax(bucket.surface->to[n]);
  }
  RTCBounds& out = *args->bounds_o;
  out.lower_x = float(lower.x() - bucket.inflation);
  out.lower_y = float(lower.y() - bucket.inflation);
  out.lower_z = float(lower.z() - bucket.inflation);
  out.upper_x = float(upper.x() + bucket.inflation);
  out.upper_y = float(upper.y() + bucket.inflation);
  out.upper_z = float(upper.z() + bucket.inflation);
}

namespace {
struct SweepContext {
  RTCIntersectContext embree;  // first: Embree hands back a pointer to it
  Vector3d centre, motion;
  double radius, alpha;
  SurfaceHit best;
};
}  // namespace

// A ray's length in float, with slack: it may only drop what the double test would drop too.
static float rayLength(double t) {
  return float(t) * 1.00001F + 1e-6F;
}

// Keeps the lexicographic minimum of (t, triangle). The narrow phase is allowed slightly more than the best so far, so
// that equal hits are compared rather than dropped in the order of their visit.
static void sweepTriangle(const RTCIntersectFunctionNArguments* args) {
  const Bucket& bucket = *static_cast<const Bucket*>(args->geometryUserPtr);
  auto& context = *reinterpret_cast<SweepContext*>(args->context);
  const int triangle = bucket.triangles[args->primID];
  SurfaceHit& best = context.best;
  SweepHit hit;
  if (!sweepSphere(context.centre, context.motion, context.radius, bucket.surface->triangle(triangle, context.alpha),
                   best.t * (1 + 1e-9) + 1e-12, hit))
    return;
  if (hit.t > 1 || hit.t > best.t || (hit.t == best.t && best.triangle >= 0 && triangle > best.triangle)) return;
  static_cast<SweepHit&>(best) = hit;
  best.triangle = triangle;
  auto& rayHit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
  rayHit.ray.tfar = rayLength(hit.t);
  rayHit.hit.geomID = args->geomID;
  rayHit.hit.primID = args->primID;
}

static void openBucket(RTCDevice device, Bucket& bucket) {
  bucket.scene = rtcNewScene(device);
  rtcSetSceneFlags(bucket.scene, RTC_SCENE_FLAG_DYNAMIC);
  // REFIT is ignored in scenes of any higher quality.
  rtcSetSceneBuildQuality(bucket.scene, RTC_BUILD_QUALITY_LOW);
  bucket.geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryBuildQuality(bucket.geometry, RTC_BUILD_QUALITY_REFIT);
  rtcSetGeometryUserPrimitiveCount(bucket.geometry, unsigned(bucket.triangles.size()));
  rtcSetGeometryUserData(bucket.geometry, &bucket);
  rtcSetGeometryBoundsFunction(bucket.geometry, triangleBounds, nullptr);
  rtcSetGeometryIntersectFunction(bucket.geometry, sweepTriangle);
  rtcCommitGeometry(bucket.geometry);
  rtcAttachGeometry(bucket.scene, bucket.geometry);
  rtcCommitScene(bucket.scene);
}

static void appendBody(const SoftBodyModel& model, BlendedSurface& surface, std::vector<Bucket>& buckets) {
  const int firstNode = int(surface.bodyOfNode.size()), firstTriangle = int(surface.triangles.size());
  const int body = int(surface.firstNode.size());
  surface.firstNode.push_back(firstNode);
  surface.bodyOfNode.insert(surface.bodyOfNode.end(), model.restNodes.size(), body);
  for (const auto& [a, b, c] : model.triangles)
    surface.triangles.push_back({a + firstNode, b + firstNode, c + firstNode});
  for (const std::vector<int>& triangles : model.buckets) {
    if (triangles.empty()) continue;
    Bucket& bucket = buckets.emplace_back();
    for (const int t : triangles) {
      bucket.triangles.push_back(t + firstTriangle);
      const std::array<int, 3>& corners = surface.triangles[t + firstTriangle];
      bucket.nodes.insert(bucket.nodes.end(), corners.begin(), corners.end());
    }
    std::sort(bucket.nodes.begin(), bucket.nodes.end());
    bucket.nodes.erase(std::unique(bucket.nodes.begin(), bucket.nodes.end()), bucket.nodes.end());
  }
}

static void copyNodes(const DynamicsFrame& frame, std::vector<Vector3d>& nodes) {
  std::size_t n = 0;
  for (const BodyFrame& body : frame.bodies)
    for (const Vector3d& x : body.nodes) {
      assert(n < nodes.size());
      nodes[n++] = x;
    }
  assert(n == nodes.size());
}

static void renewBoundingSphere(Bucket& bucket) {
  const BlendedSurface& surface = *bucket.surface;
  Vector3d lower = Vector3d::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (const int n : bucket.nodes) {
    lower = lower.cwiseMin(surface.from[n]).cwiseMin(surface.to[n]);
    upper = upper.cwiseMax(surface.from[n]).cwiseMax(surface.to[n]);
  }
  bucket.centre = 0.5 * (lower + upper);
  double radius2 = 0;
  for (const int n : bucket.nodes)
    radius2 = std::max(
        {radius2, (surface.from[n] - bucket.centre).squaredNorm(), (surface.to[n] - bucket.centre).squaredNorm()});
  bucket.radius = std::sqrt(radius2);
}

Buckets::Buckets(const std::vector<std::shared_ptr<const SoftBodyModel>>& bodies, double largestRadius,
                 const DynamicsFrame& rest)
    : data_(std::make_unique<Data>()) {
  // One thread: queries and refits are too small to share, and the servo's core is its own.
  data_->device = rtcNewDevice("threads=1,set_affinity=0");
  if (!data_->device) throw std::runtime_error("Embree cannot start: expected a CPU with SSE2 and memory for a device");
  for (const auto& model : bodies) appendBody(*model, data_->surface, data_->buckets);
  data_->surface.from.resize(data_->surface.bodyOfNode.size());
  data_->surface.to.resize(data_->surface.bodyOfNode.size());
  data_->near.reserve(data_->surface.triangles.size());
  copyNodes(rest, data_->surface.from);
  copyNodes(rest, data_->surface.to);
  data_->surface.stepBefore.assign(data_->surface.from.size(), Vector3d::Zero());
  data_->surface.step = data_->surface.stepBefore;
  for (Bucket& bucket : data_->buckets) {
    bucket.surface = &data_->surface;
    bucket.inflation = largestRadius * boundsFactor + boundsMargin;
    openBucket(data_->device, bucket);
    renewBoundingSphere(bucket);
  }
  if (rtcGetDeviceError(data_->device) != RTC_ERROR_NONE)
    throw std::runtime_error("Embree failed to build the triangle buckets");
}
Buckets::~Buckets() = default;
Buckets::Buckets(Buckets&&) noexcept = default;
Buckets& Buckets::operator=(Buckets&&) noexcept = default;

const BlendedSurface& Buckets::surface() const {
  return data_->surface;
}

void Buckets::commit(const DynamicsFrame& from, const DynamicsFrame& to) {
  BlendedSurface& surface = data_->surface;
  copyNodes(from, surface.from);
  copyNodes(to, surface.to);
  surface.duration = to.time - from.time;
  surface.stepBefore.swap(surface.step);
  for (std::size_t n = 0; n < surface.step.size(); ++n) surface.step[n] = surface.to[n] - surface.from[n];
  for (Bucket& bucket : data_->buckets) {
    renewBoundingSphere(bucket);
    bucket.stale = true;
  }
}

static bool isNear(const Bucket& bucket, const Vector3d& centre, double distance) {
  const double reach = bucket.radius + bucket.inflation + distance;
  return (centre - bucket.centre).squaredNorm() <= reach * reach;
}

// Refits where a query gets as far as the bucket's triangles: in a large scene a tool is near a few of hundreds.
static RTCScene currentScene(Bucket& bucket) {
  if (bucket.stale) {
    rtcCommitGeometry(bucket.geometry);
    rtcCommitScene(bucket.scene);
    bucket.stale = false;
  }
  return bucket.scene;
}

void Buckets::refitNear(const Vector3d& centre, double distance) {
  for (Bucket& bucket : data_->buckets)
    if (isNear(bucket, centre, distance)) currentScene(bucket);
}

static bool isQueryable(const Vector3d& p) {
  return p.allFinite() && p.lpNorm<Eigen::Infinity>() <= 2 * toolReach;
}

static double distanceToSegment2(const Vector3d& p, const Vector3d& start, const Vector3d& motion, double motion2) {
  const double along = motion2 > 0 ? std::clamp((p - start).dot(motion) / motion2, 0.0, 1.0) : 0;
  return (start + along * motion - p).squaredNorm();
}

bool Buckets::sweep(const Vector3d& centre, const Vector3d& motion, double radius, double alpha,
                    SurfaceHit& hit) const {
  assert(isQueryable(centre) && isQueryable(centre + motion) && radius >= 0 && alpha >= 0 && alpha <= 1);
  const double motion2 = motion.squaredNorm();
  if (motion2 < 1e-24) return false;  // far below every margin, and a ray needs a direction in float
  SweepContext context{{}, centre, motion, radius, alpha, {}};
  rtcInitIntersectContext(&context.embree);
  for (Bucket& bucket : data_->buckets) {
    const double reach = bucket.radius + bucket.inflation;
    if (distanceToSegment2(bucket.centre, centre, motion, motion2) > reach * reach) continue;
    RTCRayHit ray{};
    ray.ray.org_x = float(centre.x());
    ray.ray.org_y = float(centre.y());
    ray.ray.org_z = float(centre.z());
    ray.ray.dir_x = float(motion.x());
    ray.ray.dir_y = float(motion.y());
    ray.ray.dir_z = float(motion.z());
    ray.ray.tfar = rayLength(context.best.t);
    ray.ray.mask = ~0U;
    ray.hit.geomID = ray.hit.primID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(currentScene(bucket), &context.embree, &ray);
  }
  if (context.best.triangle < 0) return false;
  hit = context.best;
  return true;
}

namespace {
struct NearQuery {
  const Bucket* bucket;
  std::vector<int>* found;
};
}  // namespace

static bool collectTriangle(RTCPointQueryFunctionArguments* args) {
  const auto& query = *static_cast<const NearQuery*>(args->userPtr);
  query.found->push_back(query.bucket->triangles[args->primID]);
  return false;  // the query's radius stays as it is
}

const std::vector<int>& Buckets::near(const Vector3d& centre, double distance) {
  assert(isQueryable(centre) && std::isfinite(distance) && distance >= 0);
  std::vector<int>& found = data_->near;
  found.clear();
  for (Bucket& bucket : data_->buckets) {
    if (!isNear(bucket, centre, distance)) continue;
    RTCPointQuery point{float(centre.x()), float(centre.y()), float(centre.z()), 0,
                        float(distance * boundsFactor + boundsMargin)};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    NearQuery query{&bucket, &found};
    rtcPointQuery(currentScene(bucket), &point, &context, collectTriangle, &query);
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string embreeVersion() {
  const RTCDevice device = rtcNewDevice("threads=1,set_affinity=0");
  if (!device) return "does not start";
  const auto number = [&](RTCDeviceProperty property) {
    return std::to_string(rtcGetDeviceProperty(device, property));
  };
  std::string version = number(RTC_DEVICE_PROPERTY_VERSION_MAJOR) + "." + number(RTC_DEVICE_PROPERTY_VERSION_MINOR) +
                        "." + number(RTC_DEVICE_PROPERTY_VERSION_PATCH);
  rtcReleaseDevice(device);
  return version;
}

}  // namespace medulla
