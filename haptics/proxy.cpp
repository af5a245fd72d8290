#include "haptics/proxy.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <string>

#include "haptics/force_bounds.h"
#include "haptics/force_shading.h"
#include "haptics/half_spaces.h"
#include "haptics/inside.h"
#include "physics/dynamics/frame.h"

namespace medulla {

using Eigen::Vector3d;

// Of the tool's radius, so that scenes of any size are felt alike: the proxy stops this far short of a surface, so that
// rounding never puts it inside; farther than `kTouching` a contact is over; below `kArrived` it has arrived. Chosen
// with tools of 3 mm.
static constexpr double kStandOff = 5e-8 / 3e-3, kTouching = 1e-6 / 3e-3, kArrived = 1e-9 / 3e-3;
// Enough for every groove and corner met in a tick; what is left is done in the next.
static constexpr int kMaxSweeps = 10, kMaxPushes = 10, kMaxPasses = 4;

// ---- Half-spaces collected on the way ------------------------------------------------------------------

namespace {
struct TouchedPlanes {
  std::array<HalfSpace, 3> planes;
  std::array<int, 3> triangles{};
  std::array<double, 3> pressure{};
  int count = 0;

  std::span<const HalfSpace> all() const { return std::span(planes).first(count); }
};
}  // namespace

// A fourth plane replaces the one that holds the proxy back least, by what is known: the one added last does not yet,
// and goes first. (Kept instead, it let the force of slides over fine meshes turn half as much again.) Nearly parallel
// ones count as one.
static void addPlane(TouchedPlanes& touched, const HalfSpace& plane, int triangle) {
  for (int k = 0; k < touched.count; ++k)
    if (touched.planes[k].normal.dot(plane.normal) > 1 - 1e-9) {
      touched.planes[k] = plane;
      touched.triangles[k] = triangle;
      return;
    }
  int slot = touched.count;
  if (slot == 3)
    slot = int(std::min_element(touched.pressure.begin(), touched.pressure.end()) - touched.pressure.begin());
  else
    ++touched.count;
  touched.planes[slot] = plane;
  touched.triangles[slot] = triangle;
}

static void dropPlane(TouchedPlanes& touched, int k) {
  --touched.count;
  touched.planes[k] = touched.planes[touched.count];
  touched.triangles[k] = touched.triangles[touched.count];
}

// ---- The device moves ------------------------------------------------------------------------------------

// Moves the proxy to `target` or kStandOff short of the first surface on the way. The step back along the path grows at
// grazing incidence, so that the distance to the surface stays kStandOff.
static bool moveTo(const Buckets& buckets, double alpha, const Vector3d& target, Proxy& proxy, SurfaceHit& hit) {
  const Vector3d motion = target - proxy.centre;
  if (!buckets.sweep(proxy.centre, motion, proxy.radius, alpha, proxy.lastBucket, hit)) {
    proxy.centre = target;
    return false;
  }
  proxy.lastBucket = hit.bucket;
  const double length = motion.norm(), incidence = std::max(0.02, -hit.normal.dot(motion) / length);
  proxy.centre += std::max(0.0, hit.t - kStandOff * proxy.toolRadius / (incidence * length)) * motion;
  return true;
}

static double distanceTo(const Buckets& buckets, double alpha, int triangle, const Vector3d& p) {
  return (p - closestPoint(buckets.surface().triangle(triangle, alpha), p).point).norm();
}

// A sphere that rolled over an edge has left the plane it first met there.
static void dropLeftPlanes(const Buckets& buckets, double alpha, const Proxy& proxy, TouchedPlanes& touched) {
  for (int k = touched.count - 1; k >= 0; --k)
    if (distanceTo(buckets, alpha, touched.triangles[k], proxy.centre) > proxy.radius + kTouching * proxy.toolRadius)
      dropPlane(touched, k);
}

// God-object search: sweep towards the target; at a hit, the target becomes the point nearest to the goal that the
// touched planes allow (Zilles and Salisbury 1995).
static TouchedPlanes slideTo(const Buckets& buckets, double alpha, const Vector3d& goal, Proxy& proxy) {
  TouchedPlanes touched;
  Vector3d target = goal;
  for (int k = 0; k < kMaxSweeps && (target - proxy.centre).norm() >= kArrived * proxy.toolRadius; ++k) {
    SurfaceHit hit;
    if (moveTo(buckets, alpha, target, proxy, hit))
      addPlane(touched, {hit.normal, hit.normal.dot(proxy.centre)}, hit.triangle);
    // Not at the end: a proxy that is still rolling over an edge has not lost contact.
    if (k + 1 < kMaxSweeps) dropLeftPlanes(buckets, alpha, proxy, touched);
    if (nearestInHalfSpaces(goal, touched.all(), target, touched.pressure)) continue;
    // Wedged between walls that leave no point free: it stays, and presses on what opposes the goal.
    for (int i = 0; i < touched.count; ++i)
      touched.pressure[i] = std::max(0.0, -touched.planes[i].normal.dot(goal - proxy.centre));
    break;
  }
  return touched;
}

static ProxyContact contactAt(const Buckets& buckets, double alpha, int triangle, const Vector3d& centre) {
  const TrianglePoint q = closestPoint(buckets.surface().triangle(triangle, alpha), centre);
  return {triangle, q.weights, q.point, (centre - q.point).normalized(), 0};
}

static void keepPressingContacts(const Buckets& buckets, double alpha, const TouchedPlanes& touched, Proxy& proxy) {
  proxy.contactCount = 0;
  double sum = 0;
  for (int k = 0; k < touched.count; ++k) {
    if (!(touched.pressure[k] > kArrived * proxy.toolRadius)) continue;
    ProxyContact& contact = proxy.contacts[proxy.contactCount++];
    contact = contactAt(buckets, alpha, touched.triangles[k], proxy.centre);
    contact.share = touched.pressure[k];
    sum += contact.share;
  }
  for (int k = 0; k < proxy.contactCount; ++k) proxy.contacts[k].share /= sum;
}

// What is felt comes to what is touched, from `from` to `to`, no faster than the tool passes the surface (`way`, m), by
// half of what is missing in a tick at most, and by `atRest` of it where it rests: which three of a dent's many walls
// hold the proxy changes from tick to tick, and with them what a smooth surface would do.
static Vector3d approached(const Vector3d& from, const Vector3d& to, double way, double atRest) {
  constexpr double kMost = 0.5;
  const Vector3d change = to - from;
  const double length = change.norm();
  if (!(length > 0)) return to;
  return from + std::min(kMost, std::max(atRest, way / length)) * change;
}

// Where the smooth surface would hold the proxy by what it touches: the first pass of Ruspini, Kolarov and Khatib 1997.
// Their second pass moves the proxy there. Rejected: a device under a convex edge has two places nearest to it, between
// which the proxy then alternated, and a proxy that slides in the dent that it makes lets soft tissue flutter.
// Going from one such place to the other still makes the pull jump. What is felt therefore comes from the last tick's
// pull, lengthened by what device and surface have moved along it since: no jump is felt at once, and plain pressing is
// not delayed.
static void shade(const Buckets& buckets, double alpha, const TouchedPlanes& touched, const Vector3d& device,
                  const Vector3d& advance, double atRest, Proxy& proxy) {
  constexpr double flat = 1e-6;  // rad
  std::array<HalfSpace, 3> shaded;
  int count = 0;
  bool isFlat = true;
  for (int k = 0; k < touched.count; ++k) {
    if (!(touched.pressure[k] > kArrived * proxy.toolRadius)) continue;
    const ProxyContact contact = contactAt(buckets, alpha, touched.triangles[k], proxy.centre);
    const Vector3d normal = shadedNormal(buckets.surface(), alpha, contact.triangle, contact.weights, contact.normal);
    isFlat = isFlat && (normal - contact.normal).norm() < flat;
    shaded[count++] = {normal, normal.dot(proxy.centre)};
  }
  const Vector3d before = proxy.felt;
  Vector3d nearest;
  std::array<double, 3> pressure;
  proxy.felt = Vector3d::Zero();
  if (count > 0 && !isFlat && nearestInHalfSpaces(device, std::span(shaded).first(count), nearest, pressure)) {
    proxy.felt = nearest - device;
    if (const double length = before.norm(); length > 0) {
      const double moved = -before.dot(advance) / length;
      proxy.felt = approached(std::max(0.0, length + moved) / length * before, proxy.felt, advance.norm(), atRest);
    }
  }
  proxy.device = device;
  proxy.surfaceMotion.setZero();  // jaws that close look twice in a tick
}

static double sumOf(const std::array<double, 3>& pressure, int count) {
  return std::accumulate(pressure.begin(), pressure.begin() + count, 0.0);
}

// Where the device would draw the proxy if there were no friction, along the planes alone that stop it right here, and
// what then presses on these, summed (m). False where none does. The triangles touched a tick ago do not tell: a proxy
// that slid off one is within kTouching of it for a tenth of a millimetre more, and their normal leans by then. Of the
// two walls of a dent that moves, all but one have come off it by a few micrometres: those that are met on the way to
// where the first would let it slide count, too. Else it would seem to slide across, back and forth.
static bool freeOfTouched(const Buckets& buckets, double alpha, Proxy proxy, const Vector3d& device, Vector3d& free,
                          double& pressed) {
  constexpr double kNear = 2e-5 / 3e-3;  // of several touched surfaces that move apart only their mean is kept up with
  const auto step = [&](const Vector3d& way) -> Vector3d {
    return std::min(1.0, kNear * proxy.toolRadius / way.norm()) * way;
  };
  const Vector3d start = proxy.centre, inwards = start + step(device - start);
  TouchedPlanes touched = slideTo(buckets, alpha, inwards, proxy);
  std::array<double, 3> pressure;
  if (touched.count == 0 || !nearestInHalfSpaces(device, touched.all(), free, pressure)) return false;
  proxy.centre = start;
  const TouchedPlanes ahead = slideTo(buckets, alpha, inwards + step(free - start), proxy);
  for (int k = 0; k < ahead.count; ++k) addPlane(touched, ahead.planes[k], ahead.triangles[k]);
  if (!nearestInHalfSpaces(device, touched.all(), free, pressure)) return false;
  pressed = sumOf(pressure, touched.count);
  return (free - device).norm() > kArrived * proxy.toolRadius;
}

// Coulomb friction as a change of the goal. Without friction the proxy would slide from where it is to `free`, pressed
// by the depth |free - device|: on what it touches by `pressed` in all, in a groove more than that. It may trail behind
// `free` by up to mu times `pressed`. Stick: the goal is pulled back onto the line through the proxy along the contact
// normal; slip: by exactly mu_d `pressed`. Solving again towards the new goal, rather than moving `free` back, keeps
// grooves and bumps right.
//
// `free` lies on the planes touched now, not on those met on the way: a proxy that sticks by the normal of the next
// triangle while it lies on this one is pushed on by depth times the angle between them each tick, as far as the next
// crease of the mesh, however slight.
static Vector3d frictionGoal(const ToolSettings& tool, const Vector3d& free, double pressed, const Vector3d& device,
                             const Vector3d& advance, Proxy& proxy) {
  // m per tick, 12 um/s of a tool of 3 mm: what slips no farther sticks, else it would slip at rest.
  const double still = 1e-8 / 3e-3 * proxy.toolRadius;
  const double least = tool.dynamicFriction * pressed;
  const Vector3d slide = tangential(free - proxy.centre, (free - device).normalized());
  const double length = slide.norm();
  if (length > (proxy.slipping ? least + still : tool.staticFriction * pressed)) {
    proxy.slipping = true;
    proxy.slideDirection = slide / length;
    return device - least * proxy.slideDirection;
  }
  // A slide that pauses in a crease of the mesh, held by the next triangle as well, has not come to rest while the
  // device goes on: else static friction would have to be overcome in each, and what presses would go over from one
  // triangle to the other at once. A tenth less is the depth's change from one triangle to the other.
  const Vector3d& along = proxy.slideDirection;
  const double trail = std::min(least, along.dot(device - proxy.centre));
  proxy.slipping = proxy.slipping && trail > 0.9 * least && along.dot(advance) > still;
  return device - (proxy.slipping ? Vector3d(trail * along) : slide);
}

void followDevice(const Buckets& buckets, double alpha, const ToolSettings& tool, const Vector3d& device,
                  double tickDuration, Proxy& proxy) {
  constexpr double kRest = 0.026;  // s
  const double atRest = 1 - std::exp(-tickDuration / kRest);
  const Vector3d start = proxy.centre, advance = device - proxy.device - proxy.surfaceMotion;
  Vector3d free, goal = device;
  double pressed = 0;
  const bool isHeld = tool.staticFriction > 0 && freeOfTouched(buckets, alpha, proxy, device, free, pressed);
  TouchedPlanes touched = slideTo(buckets, alpha, device, proxy);
  shade(buckets, alpha, touched, device, advance, atRest, proxy);
  if (!isHeld) {
    free = proxy.centre;
    pressed = sumOf(touched.pressure, touched.count);
  }
  const bool isPressed = touched.count > 0 && (proxy.centre - device).norm() > kArrived * proxy.toolRadius;
  if (isPressed && tool.staticFriction > 0) {
    proxy.centre = start;
    goal = frictionGoal(tool, free, pressed, device, advance, proxy);
    proxy.wedging = std::max(1.0, pressed / (free - device).norm());
    touched = slideTo(buckets, alpha, goal, proxy);
  }
  // Friction, too: where three walls hold the proxy it cannot slide and there seems to be none, and a tick later, one
  // of them left, it is there in full. A slide over triangles of 2.5 mm, 3 mm deep in tissue of 10 kPa, felt its force
  // turn by 20 degrees in a tick.
  const bool isShaded = !proxy.felt.isZero(0);
  proxy.drag = isShaded ? approached(proxy.drag, goal - device, advance.norm(), atRest) : Vector3d(goal - device);
  proxy.shading = isShaded ? Vector3d(proxy.felt + proxy.drag - (proxy.centre - device)) : Vector3d::Zero();
  keepPressingContacts(buckets, alpha, touched, proxy);
  if (proxy.inContact()) return;
  proxy.slipping = true;
  proxy.slideDirection.setZero();
}

// ---- The surface moves -----------------------------------------------------------------------------------

// The mean motion of what the proxy touches. Without it a still tool feels nothing of a surface that moves through it.
static Vector3d carriedBy(const Buckets& buckets, double alpha, const Proxy& proxy) {
  Vector3d motion = Vector3d::Zero();
  for (int k = 0; k < proxy.contactCount; ++k) {
    const ProxyContact& contact = proxy.contacts[k];
    motion +=
        contact.share * (pointAt(buckets.surface().triangle(contact.triangle, alpha), contact.weights) - contact.point);
  }
  return motion;
}

// The path of the proxy from where it is to `end` as seen from each moving triangle (Ruspini and Khatib 2000, "adjusted
// segment"): the start is shifted by the triangle's own motion near it. Where a triangle would pass the proxy, the end
// is moved back to the touched side. Repeated, because moving back from one triangle may meet another.
static Vector3d notPassedOver(const Buckets& buckets, double alphaBefore, double alpha, const Proxy& proxy,
                              Vector3d end) {
  const Vector3d& start = proxy.centre;
  const double standOff = kStandOff * proxy.toolRadius;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    Vector3d corrected = end;
    double largest = 0;
    for (const int t : buckets.near(0.5 * (start + end), 0.5 * (end - start).norm() + standOff)) {
      const Triangle before = buckets.surface().triangle(t, alphaBefore), now = buckets.surface().triangle(t, alpha);
      const TrianglePoint closest = closestPoint(before, start);
      const Vector3d adjusted = start + pointAt(now, closest.weights) - closest.point;
      SweepHit hit;
      if (!sweepSphere(adjusted, end - adjusted, proxy.radius, now, 1, hit)) continue;
      const Vector3d outside = adjusted + hit.t * (end - adjusted) + standOff * hit.normal;
      if ((outside - end).norm() <= largest) continue;
      largest = (outside - end).norm();
      corrected = outside;
    }
    if (largest == 0) break;
    end = corrected;
  }
  return end;
}

static int nearestTriangle(const Buckets& buckets, double alpha, const Vector3d& p, double& distance) {
  int nearest = -1;
  for (const int t : buckets.near(p, 0)) {
    const double d = distanceTo(buckets, alpha, t, p);
    if (d >= distance) continue;
    distance = d;
    nearest = t;
  }
  return nearest;
}

// Triangles that turn over as they pass, as small ones around a pole do that flutter, do not see the proxy cross them,
// and where no end of passes is found, some are passed. Then it goes on from just outside of the triangle that was
// nearest to it, over the place that was nearest.
//
// More than what is nearest is asked only from behind that, and where a contact was lost.
static void keepOutside(const Buckets& buckets, double alphaBefore, double alpha, const Vector3d& start, Proxy& proxy) {
  const bool lost = proxy.lookNext && !proxy.inContact();
  proxy.lookNext = proxy.inContact();
  if (!lost && !liesBehind(buckets, alpha, proxy.centre)) return;
  if (windingNumber(buckets, alpha, proxy.centre) <= 0) return;
  const double standOff = kStandOff * proxy.toolRadius;
  double distance = std::numeric_limits<double>::infinity();
  const int t = nearestTriangle(buckets, alphaBefore, start, distance);
  if (t >= 0) {
    const Vector3d weights = closestPoint(buckets.surface().triangle(t, alphaBefore), start).weights;
    proxy.centre = justOutside(buckets.surface().triangle(t, alpha), weights, standOff);
  }
  proxy.centre = outOfBodies(buckets, alpha, standOff, proxy.centre);
  proxy.lookNext = true;
}

// The half-space in which the whole tool is clear of a triangle, seen from where the proxy is.
static void addClearance(const Buckets& buckets, double alpha, int triangle, const Proxy& proxy,
                         TouchedPlanes& touched) {
  const Vector3d q = closestPoint(buckets.surface().triangle(triangle, alpha), proxy.centre).point;
  const Vector3d normal = (proxy.centre - q).normalized();
  addPlane(touched, {normal, normal.dot(q) + (1 + kStandOff) * proxy.toolRadius}, triangle);
}

// m: by how much the half-spaces are missed at most.
static double missingFrom(const Vector3d& p, const TouchedPlanes& touched) {
  double missing = 0;
  for (int k = 0; k < touched.count; ++k)
    missing = std::max(missing, touched.planes[k].offset - touched.planes[k].normal.dot(p));
  return missing;
}

// Moves the proxy out to kStandOff beyond the tool's radius from every triangle, by the shortest way that the planes
// found so far allow. Each move is swept with the clearance there is, so that pushing out of one surface never leads
// through another; where no room is found the proxy keeps the clearance it has. None is found in the wedge of two faces
// all but parallel, whose mouth may be metres away.
static void pushOut(const Buckets& buckets, double alpha, Proxy& proxy) {
  constexpr double kSteepest = 100;  // of what is missing: a wedge of 1 degree
  TouchedPlanes touched;
  const Vector3d start = proxy.centre;
  for (int k = 0; k <= kMaxPushes; ++k) {
    proxy.radius = proxy.toolRadius;
    const int nearest = nearestTriangle(buckets, alpha, proxy.centre, proxy.radius);
    if (nearest < 0 || k == kMaxPushes) return;
    addClearance(buckets, alpha, nearest, proxy, touched);
    Vector3d target;
    if (!nearestInHalfSpaces(start, touched.all(), target, touched.pressure)) return;
    if ((target - start).norm() > std::min(2 * proxy.toolRadius, kSteepest * missingFrom(start, touched))) return;
    SurfaceHit hit;
    if (moveTo(buckets, alpha, target, proxy, hit)) addClearance(buckets, alpha, hit.triangle, proxy, touched);
  }
}

void followSurface(const Buckets& buckets, double alphaBefore, double alpha, Proxy& proxy) {
  const Vector3d start = proxy.centre, carried = start + carriedBy(buckets, alpha, proxy);
  if (!(carried.lpNorm<Eigen::Infinity>() <= kToolReach))
    throw NotFinite("a touched surface carried the tool beyond " + std::to_string(int(kToolReach)) +
                    " m: the state of its body is not finite any more in effect; use more substeps");
  proxy.centre = notPassedOver(buckets, alphaBefore, alpha, proxy, carried);
  keepOutside(buckets, alphaBefore, alpha, start, proxy);
  pushOut(buckets, alpha, proxy);
  proxy.surfaceMotion = proxy.centre - start;
  for (int k = 0; k < proxy.contactCount; ++k) {
    ProxyContact& contact = proxy.contacts[k];
    contact.point = pointAt(buckets.surface().triangle(contact.triangle, alpha), contact.weights);
  }
}

// ---- The start -------------------------------------------------------------------------------------------

const ProxyContact& Proxy::mainContact() const {
  assert(contactCount > 0);
  return *std::max_element(contacts.begin(), contacts.begin() + contactCount,
                           [](const ProxyContact& a, const ProxyContact& b) { return a.share < b.share; });
}

Vector3d Proxy::feltNormal() const {
  assert(contactCount > 0);
  if (!felt.isZero(0)) return felt.normalized();
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < contactCount; ++k) sum += contacts[k].share * contacts[k].normal;
  return sum.normalized();
}

Proxy placeProxy(const Buckets& buckets, const Vector3d& device, double toolRadius) {
  Proxy proxy;
  proxy.toolRadius = toolRadius;
  proxy.device = device;
  proxy.centre = outOfBodies(buckets, 1, kStandOff * toolRadius, device);
  proxy.radius = std::min(toolRadius, distanceToSurface(buckets.surface(), 1, proxy.centre));
  return proxy;
}

}  // namespace medulla
