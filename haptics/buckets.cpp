#include "haptics/buckets.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "haptics/force_shading.h"
#include "haptics/tool_input.h"
#include "physics/dynamics/simd.h"
#include "physics/sort_unique.h"

namespace medulla {

using Eigen::Vector3d;

// Bounds are grown beyond the sphere's radius by what float rays within kToolReach can be off. Embree's ROBUST flag
// does not reach user geometry.
static constexpr double kBoundsFactor = 1.001, kBoundsMargin = 1e-5;  // -, m

namespace {
struct Bucket {
  RTCScene scene = nullptr;
  RTCGeometry geometry = nullptr;
  const BlendedSurface* surface = nullptr;
  int index = 0;
  double largestRadius = 0, inflation = 0;  // m
  std::vector<int> triangles;
  std::vector<int> nodes;  // of the triangles, each once
  bool fitted = true;      // the scene bounds the surface's frames, not older ones
};

struct BoundGroup {  // of four buckets
  Lanes3 centre = zeroVectors();
  Lanes radius = splat(0);
};
}  // namespace

struct Buckets::Data {
  RTCDevice device = nullptr;
  BlendedSurface surface;
  std::vector<Bucket> buckets;
  // The sphere around both frames, its radius (m) inflated as the buckets' bounds are. Every query asks them all: side
  // by side they fit a first-level cache.
  std::vector<BoundGroup> bounds;
  std::vector<int> near;  // result of the last near() or above(): reserved for all triangles

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

// Around both frames.
template <typename Nodes>
static void bound(const BlendedSurface& surface, const Nodes& nodes, Vector3d& lower, Vector3d& upper) {
  lower = Vector3d::Constant(std::numeric_limits<double>::infinity());
  upper = -lower;
  for (const int n : nodes) {
    lower = lower.cwiseMin(surface.from[n]).cwiseMin(surface.to[n]);
    upper = upper.cwiseMax(surface.from[n]).cwiseMax(surface.to[n]);
  }
}

static void triangleBounds(const RTCBoundsFunctionArguments* args) {
  const Bucket& bucket = *static_cast<const Bucket*>(args->geometryUserPtr);
  Vector3d lower, upper;
  bound(*bucket.surface, bucket.surface->triangles[bucket.triangles[args->primID]], lower, upper);
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
static bool sweepTriangle(const Bucket& bucket, int triangle, SweepContext& context) {
  SurfaceHit& best = context.best;
  SweepHit hit;
  if (!sweepSphere(context.centre, context.motion, context.radius, bucket.surface->triangle(triangle, context.alpha),
                   best.t * (1 + 1e-9) + 1e-12, hit))
    return false;
  if (hit.t > 1 || hit.t > best.t || (hit.t == best.t && best.triangle >= 0 && triangle > best.triangle)) return false;
  static_cast<SweepHit&>(best) = hit;
  best.triangle = triangle;
  best.bucket = bucket.index;
  return true;
}

static void sweepCandidate(const RTCIntersectFunctionNArguments* args) {
  const Bucket& bucket = *static_cast<const Bucket*>(args->geometryUserPtr);
  auto& context = *reinterpret_cast<SweepContext*>(args->context);
  if (!sweepTriangle(bucket, bucket.triangles[args->primID], context)) return;
  auto& rayHit = *reinterpret_cast<RTCRayHit*>(args->rayhit);
  rayHit.ray.tfar = rayLength(context.best.t);
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
  rtcSetGeometryIntersectFunction(bucket.geometry, sweepCandidate);
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
    sortUnique(bucket.nodes);
  }
}

// Of as many bodies as can be touched.
static void copyNodes(const DynamicsFrame& frame, std::size_t bodies, std::vector<Vector3d>& nodes) {
  assert(bodies <= frame.bodies.size());
  std::size_t n = 0;
  for (std::size_t b = 0; b < bodies; ++b)
    for (const Vector3d& x : frame.bodies[b].nodes) {
      assert(n < nodes.size());
      nodes[n++] = x;
    }
  assert(n == nodes.size());
}

static Lanes loadNode(const Vector3d& x) {  // (x, y, z, 0)
  return _mm256_maskload_pd(x.data(), _mm256_setr_epi64x(-1, -1, -1, 0));
}

// Of four nodes, or fewer where fewer are left.
static Lanes squaredDistances(const std::vector<Vector3d>& all, const int* nodes, std::size_t left, Lanes centre) {
  Lanes a = loadNode(all[nodes[0]]) - centre, b = loadNode(all[nodes[left > 1 ? 1 : 0]]) - centre;
  Lanes c = loadNode(all[nodes[left > 2 ? 2 : 0]]) - centre, d = loadNode(all[nodes[left > 3 ? 3 : 0]]) - centre;
  return sumsOfLanes(a * a, b * b, c * c, d * d);
}

// About the middle of the box around both frames.
static void setBounds(const Bucket& bucket, std::vector<BoundGroup>& bounds) {
  const BlendedSurface& surface = *bucket.surface;
  Lanes lower = splat(std::numeric_limits<double>::infinity()), upper = splat(0) - lower;
  for (const int n : bucket.nodes) {
    const Lanes from = loadNode(surface.from[n]), to = loadNode(surface.to[n]);
    lower = smaller(lower, smaller(from, to));
    upper = larger(upper, larger(from, to));
  }
  const Lanes centre = splat(0.5) * (lower + upper);
  Lanes squared = splat(0);
  for (std::size_t i = 0; i < bucket.nodes.size(); i += 4) {
    const std::size_t left = bucket.nodes.size() - i;
    squared = larger(squared, larger(squaredDistances(surface.from, &bucket.nodes[i], left, centre),
                                     squaredDistances(surface.to, &bucket.nodes[i], left, centre)));
  }
  BoundGroup& group = bounds[bucket.index / 4];
  const int lane = bucket.index % 4;
  setLane(group.centre, lane, {centre[0], centre[1], centre[2]});
  group.radius[lane] = std::sqrt(largestOfLanes(squared)) + bucket.inflation;
}

bool isEmbreeIsa(const std::string& isa) {
  if (isa == "sse2") return __builtin_cpu_supports("sse2");
  if (isa == "sse4.2") return __builtin_cpu_supports("sse4.2");
  if (isa == "avx") return __builtin_cpu_supports("avx");
  if (isa == "avx2") return __builtin_cpu_supports("avx2");
  if (isa != "avx512") return false;
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
}

static std::string deviceConfig(const EmbreeSettings& embree) {
  std::string config = "set_affinity=0,threads=" + std::to_string(embree.threads);
  if (!embree.isa.empty()) config += ",isa=" + embree.isa;
  return config;
}

Buckets::Buckets(const std::vector<TouchableBody>& bodies, double largestRadius, const DynamicsFrame& rest,
                 const EmbreeSettings& embree)
    : data_(std::make_unique<Data>()) {
  data_->device = rtcNewDevice(deviceConfig(embree).c_str());
  if (!data_->device) throw std::runtime_error("Embree cannot start: expected a CPU with SSE2 and memory for a device");
  BlendedSurface& surface = data_->surface;
  for (const TouchableBody& body : bodies) {
    appendBody(*body.model, surface, data_->buckets);
    surface.give.insert(surface.give.end(), body.give.begin(), body.give.end());
    surface.give.resize(surface.bodyOfNode.size());
  }
  data_->near.reserve(surface.triangles.size());
  data_->bounds.resize((data_->buckets.size() + 3) / 4);
  surface.from.resize(surface.bodyOfNode.size());
  surface.to.resize(surface.bodyOfNode.size());
  copyNodes(rest, bodies.size(), surface.from);
  copyNodes(rest, bodies.size(), surface.to);
  const TriangleMesh restMesh{surface.from, surface.triangles};
  surface.trianglesOfNodes = trianglesOfVertices(restMesh);
  surface.isCrease = nodesOnCreases(restMesh);
  for (auto& step : surface.steps) step.assign(surface.from.size(), Vector3d::Zero());
  for (std::size_t k = 0; k < data_->buckets.size(); ++k) {
    Bucket& bucket = data_->buckets[k];
    bucket.surface = &surface;
    bucket.index = int(k);
    bucket.largestRadius = largestRadius;
    bucket.inflation = largestRadius * kBoundsFactor + kBoundsMargin;
    openBucket(data_->device, bucket);
    setBounds(bucket, data_->bounds);
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

// ---- Dynamics side ---------------------------------------------------------------------------------------

void Buckets::commit(const DynamicsFrame& from, const DynamicsFrame& to,
                     const std::array<std::vector<Vector3d>, 3>& stepsBefore,
                     const std::array<std::vector<Vector3d>, 2>& toolForce, double toolForceAge) {
  BlendedSurface& surface = data_->surface;
  assert(stepsBefore[0].size() == surface.from.size());
  copyNodes(from, surface.firstNode.size(), surface.from);
  copyNodes(to, surface.firstNode.size(), surface.to);
  surface.duration = to.time - from.time;
  surface.toolForce = toolForce;
  surface.toolForceAge = toolForceAge;
  surface.steps[2] = stepsBefore[1];
  surface.steps[1] = stepsBefore[0];
  for (std::size_t n = 0; n < surface.from.size(); ++n) surface.steps[0][n] = surface.to[n] - surface.from[n];
  for (Bucket& bucket : data_->buckets) {
    setBounds(bucket, data_->bounds);
    bucket.fitted = false;
  }
}

// Calls `visit` with every bucket whose bounding sphere comes within `distance` of `centre`, in their order.
template <typename List, typename Visit>
static void visitNear(List& buckets, const std::vector<BoundGroup>& bounds, const Vector3d& centre, double distance,
                      const Visit& visit) {
  const Lanes3 from{splat(centre.x()), splat(centre.y()), splat(centre.z())};
  for (std::size_t first = 0; first < buckets.size(); first += 4) {
    const BoundGroup& group = bounds[first / 4];
    const Lanes3 away = group.centre - from;
    const Lanes reach = group.radius + splat(distance);
    const int far = _mm256_movemask_pd(isLess(reach * reach, dot(away, away)));
    for (std::size_t k = 0; far != 15 && k < 4 && first + k < buckets.size(); ++k)
      if (!(far >> k & 1)) visit(buckets[first + k]);
  }
}

void Buckets::refitNear(const Vector3d& centre, double distance) {
  visitNear(data_->buckets, data_->bounds, centre, distance, [](Bucket& bucket) {
    if (bucket.fitted) return;
    rtcCommitGeometry(bucket.geometry);
    rtcCommitScene(bucket.scene);
    bucket.fitted = true;
  });
}

// ---- Servo side ------------------------------------------------------------------------------------------

static bool isQueryable(const Vector3d& p) {
  return p.allFinite() && p.lpNorm<Eigen::Infinity>() <= 2 * kToolReach;
}

static double distanceToSegment2(const Vector3d& p, const Vector3d& start, const Vector3d& motion, double motion2) {
  const double along = motion2 > 0 ? std::clamp((p - start).dot(motion) / motion2, 0.0, 1.0) : 0;
  return (start + along * motion - p).squaredNorm();
}

static void sweepBucket(const Bucket& bucket, SweepContext& context) {
  if (!bucket.fitted) {
    for (const int triangle : bucket.triangles) sweepTriangle(bucket, triangle, context);
    return;
  }
  RTCRayHit ray{};
  ray.ray.org_x = float(context.centre.x());
  ray.ray.org_y = float(context.centre.y());
  ray.ray.org_z = float(context.centre.z());
  ray.ray.dir_x = float(context.motion.x());
  ray.ray.dir_y = float(context.motion.y());
  ray.ray.dir_z = float(context.motion.z());
  ray.ray.tfar = rayLength(context.best.t);
  ray.ray.mask = ~0U;
  ray.hit.geomID = ray.hit.primID = ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(bucket.scene, &context.embree, &ray);
}

bool Buckets::sweep(const Vector3d& centre, const Vector3d& motion, double radius, double alpha, int firstBucket,
                    SurfaceHit& hit) const {
  assert(isQueryable(centre) && isQueryable(centre + motion) && radius >= 0 && alpha >= 0 && alpha <= 1);
  const double motion2 = motion.squaredNorm();
  if (motion2 < 1e-24) return false;  // far below every margin, and a ray needs a direction in float
  SweepContext context{{}, centre, motion, radius, alpha, {}};
  rtcInitIntersectContext(&context.embree);
  if (firstBucket >= 0) sweepBucket(data_->buckets[firstBucket], context);
  const auto sweepInReach = [&](const Bucket& bucket) {
    const BoundGroup& group = data_->bounds[bucket.index / 4];
    const Vector3d middle = vectorOf(group.centre, bucket.index % 4);
    const double t = context.best.t, reach = group.radius[bucket.index % 4];
    if (bucket.index != firstBucket && distanceToSegment2(middle, centre, t * motion, t * t * motion2) <= reach * reach)
      sweepBucket(bucket, context);
  };
  visitNear(data_->buckets, data_->bounds, centre + 0.5 * motion, 0.5 * std::sqrt(motion2), sweepInReach);
  if (context.best.triangle < 0) return false;
  hit = context.best;
  return true;
}

namespace {
struct NearQuery {
  const Bucket* bucket;
  Vector3d centre;
  double distance;
  std::vector<int>* found;
};
}  // namespace

// In double, so that what is near does not depend on Embree's bounds either.
static void addIfNear(const NearQuery& query, int triangle) {
  const BlendedSurface& surface = *query.bucket->surface;
  Vector3d lower, upper;
  bound(surface, surface.triangles[triangle], lower, upper);
  const double reach = query.bucket->largestRadius + query.distance;
  const Vector3d nearest = query.centre.cwiseMax(lower).cwiseMin(upper);
  if ((query.centre - nearest).squaredNorm() <= reach * reach) query.found->push_back(triangle);
}

static bool addCandidate(RTCPointQueryFunctionArguments* args) {
  const auto& query = *static_cast<const NearQuery*>(args->userPtr);
  addIfNear(query, query.bucket->triangles[args->primID]);
  return false;  // the query's radius stays as it is
}

const std::vector<int>& Buckets::near(const Vector3d& centre, double distance) const {
  assert(isQueryable(centre) && std::isfinite(distance) && distance >= 0);
  std::vector<int>& found = data_->near;
  found.clear();
  visitNear(data_->buckets, data_->bounds, centre, distance, [&](const Bucket& bucket) {
    NearQuery query{&bucket, centre, distance, &found};
    if (!bucket.fitted) {
      for (const int triangle : bucket.triangles) addIfNear(query, triangle);
      return;
    }
    RTCPointQuery point{float(centre.x()), float(centre.y()), float(centre.z()), 0,
                        float(distance * kBoundsFactor + kBoundsMargin)};
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(bucket.scene, &point, &context, addCandidate, &query);
  });
  std::sort(found.begin(), found.end());
  return found;
}

const std::vector<int>& Buckets::above(const Vector3d& p) const {
  std::vector<int>& found = data_->near;
  found.clear();
  const std::vector<Bucket>& buckets = data_->buckets;
  for (std::size_t k = 0; k < buckets.size(); ++k) {
    const BoundGroup& group = data_->bounds[k / 4];
    const Vector3d away = vectorOf(group.centre, static_cast<int>(k % 4)) - p;
    const double reach = group.radius[k % 4];
    if (away.head<2>().squaredNorm() <= reach * reach && away.z() >= -reach)
      found.insert(found.end(), buckets[k].triangles.begin(), buckets[k].triangles.end());
  }
  return found;
}

std::string embreeVersion() {
  const RTCDevice device = rtcNewDevice(deviceConfig({}).c_str());
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
