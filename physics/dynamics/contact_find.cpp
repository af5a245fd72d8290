#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "physics/dynamics/contact_stages.h"

namespace medulla {

namespace {

Lanes velocityOfBall(const WorldData& d, std::size_t i) {
  return load(d.spheres.velocity[i]) + crossProduct(load(d.spheres.angularVelocity[i]), load(d.contact.arm[i]));
}

// Adds one side to a contact: the collider's ball at `along`. A cone's two spheres share by 1 - s and s; both carry the
// lever to their own ball's centre plus the same way to the point, so that the weighted points of application are the
// point of contact itself and torques of both sides cancel.
void addSide(const Collider& of, double along, double sign, Contact& contact) {
  const auto add = [&](std::uint32_t sphere, double weight) {
    if (weight == 0) return;
    contact.sphere[contact.ends] = sphere;
    contact.weight[contact.ends] = sign * weight;
    ++contact.ends;
  };
  add(of.sphere0, 1 - along);
  add(of.sphere1, along);
}

struct BallAt {
  Lanes centre;  // w is not defined
  double radius;
};

BallAt ballAt(const ContactData& c, const Collider& of, double along) {
  const Lanes b0 = load(c.ball[of.sphere0]), b1 = load(c.ball[of.sphere1]);
  const Lanes b = fma(splat(along), b1 - b0, b0);
  return {b, b[3]};
}

Contact& addContact(WorldData& d, std::uint32_t i, std::uint32_t j, double s, double t) {
  ContactData& c = d.contact;
  const Collider &a = c.colliders[i], &b = c.colliders[j];
  const BallAt p = ballAt(c, a, s), q = ballAt(c, b, t);
  const Lanes way = withoutFourth(q.centre - p.centre);
  const double distance = std::sqrt(dotProduct(way, way));
  Contact& contact = c.contacts.emplace_back();
  contact.key = std::uint64_t{i} << 32 | j;
  contact.gap = distance - p.radius - q.radius;
  contact.smallerRadius = std::min(p.radius, q.radius);
  // Two centres in one point know no direction: any will part them.
  contact.normal = distance > 1e-12 ? way / splat(distance) : Lanes{0, 1, 0, 0};
  contact.friction = c.rootFriction[a.body] * c.rootFriction[b.body];
  addSide(a, s, -1, contact);
  contact.firstSideEnds = contact.ends;
  addSide(b, t, 1, contact);
  contact.reach = {p.radius + 0.5 * contact.gap, -(q.radius + 0.5 * contact.gap)};
  return contact;
}

// Whether the colliders come to touch within the substep, as they move now: what is fast, or far apart, would otherwise
// be turned aside by what it misses. What is near may still be pushed against it. Conservative advancement: none of
// their points closes faster than the fastest pair of their ends. (Of the two points that are nearest now alone: what
// came aslant passed beside that of a rod and went through another.)
bool willTouch(const WorldData& d, const PairGroup& g, int lane, double gap) {
  constexpr int kSteps = 32;
  constexpr double kTouches = 1e-3;  // of the smallest radius
  const ContactData& c = d.contact;
  const Collider &a = c.colliders[g.collider0[lane]], &b = c.colliders[g.collider1[lane]];
  const std::array<std::uint32_t, 4> ends{a.sphere0, a.sphere1, b.sphere0, b.sphere1};
  Lanes velocity[4];
  for (int k = 0; k < 4; ++k) velocity[k] = withoutFourth(velocityOfBall(d, ends[k]));
  double squared = 0, smallest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) {
    const Lanes closing = velocity[k / 2] - velocity[2 + k % 2];
    squared = std::max(squared, dotProduct(closing, closing));
    smallest = std::min(smallest, c.ball[ends[k]].v[3]);
  }
  double time = 0;
  for (int step = 0; step < kSteps && gap >= kTouches * smallest; ++step) {
    time += gap / std::sqrt(squared);
    if (!(time < d.substep)) return false;
    std::array<BallLanes, 4> ball;
    for (int k = 0; k < 4; ++k) {
      Quad moved;
      store(moved, fma(splat(time), velocity[k], load(c.ball[ends[k]])));
      ball[k].centre = gather(moved, moved, moved, moved, ball[k].radius);
    }
    gap = closestOnCones(ball[0], ball[1], ball[2], ball[3]).gap[0];
  }
  return true;
}

}  // namespace

Eigen::Vector3d ballVelocity(const WorldData& d, std::uint32_t sphere) {
  const Lanes v = velocityOfBall(d, sphere);
  return {v[0], v[1], v[2]};
}

void findPairContacts(WorldData& d, double moved) {
  ContactData& c = d.contact;
  const double reach = c.reach;
  const double least = leastReach(d);
  const Lanes farAtList = splat(reach + 2 * moved), near = splat(reach);
  for (const PairGroup& g : c.pairs) {
    const Lanes perhaps = isLess(g.gapAtList, farAtList);
    if (!any(perhaps)) continue;
    const ConeContact closest = closestOfPairs(c, g);
    const int hits = _mm256_movemask_pd(masked(perhaps, isLess(closest.gap, near)));
    for (int k = 0; k < 4; ++k) {
      if ((hits >> k & 1) == 0) continue;
      const bool misses = reach > least && closest.gap[k] > 0 && !willTouch(d, g, k, closest.gap[k]);
      if (misses && closest.gap[k] > least) continue;
      addContact(d, g.collider0[k], g.collider1[k], closest.s[k], closest.t[k]).misses = misses;
    }
  }
}

void findContacts(WorldData& d) {
  ContactData& c = d.contact;
  placeBalls(d);
  double moved = farthestMove(c, c.ballAtList);
  if (c.listsAreOld || !(moved <= c.freeMove)) {
    listNeighbours(d);
    moved = 0;
  }
  c.contacts.clear();
  findPairContacts(d, moved);
  findStaticContacts(d, moved);
}

static Lanes meanVelocity(const WorldData& d, const SphereNumbers& balls) {
  Lanes sum = splat(0);
  for (const int i : balls) sum = sum + velocityOfBall(d, i);
  return splat(1.0 / std::max(balls.past - balls.first, 1)) * sum;
}

// Two balls that each move by half the reach are looked at before they touch; with half a radius more they overlap by
// that at most before they are, which neither a centre nor the middle of what is thin passes.
static bool isAnyFast(const WorldData& d, const BodyRange& body, const Lanes& common, double time) {
  const ContactData& c = d.contact;
  for (const int i : spheresOf(body)) {
    const Lanes v = velocityOfBall(d, i) - common;
    const double farthest = 0.5 * c.reach + 0.5 * c.ball[i].v[3];
    if (time * time * dotProduct(v, v) > farthest * farthest) return true;
  }
  return false;
}

// Where the body's balls are now and in `time`, and what is looked at around them.
static AxisBox sweptBox(const WorldData& d, const BodyRange& body, const Lanes& common, double time) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  const ContactData& c = d.contact;
  Lanes low = splat(kFar), high = splat(-kFar);
  for (const int i : spheresOf(body)) {
    const Lanes from = withoutFourth(load(c.ball[i])), to = fma(splat(time), velocityOfBall(d, i) - common, from);
    const Lanes around = splat(c.ball[i].v[3] + c.reach);
    low = smaller(low, smaller(from, to) - around);
    high = larger(high, larger(from, to) + around);
  }
  AxisBox box;
  store(box.low, withoutFourth(low));
  store(box.high, withoutFourth(high));
  return box;
}

// Whether anything but itself may lie in a body's way.
static bool mayMeet(const WorldData& d, std::size_t body) {
  const ContactData& c = d.contact;
  const AxisBox& own = c.swept[body];
  for (std::size_t other = 0; other < c.swept.size(); ++other) {
    if (other == body || !c.collides[body * c.swept.size() + other]) continue;
    const AxisBox& box = c.swept[other];
    bool overlaps = true;
    for (int a = 0; a < 3; ++a) overlaps = overlaps && own.low.v[a] <= box.high.v[a] && box.low.v[a] <= own.high.v[a];
    if (overlaps) return true;
  }
  const Eigen::Vector3d middle = 0.5 * (vectorOf(own.low) + vectorOf(own.high));
  const double radius = 0.5 * (vectorOf(own.high) - vectorOf(own.low)).norm();
  return std::any_of(c.statics.begin(), c.statics.end(),
                     [&](const StaticContactShape& shape) { return isNear(shape, middle, radius); });
}

// Where nothing stands still, how fast all travel together does not count: a body that falls alone would be halved for
// it, and damped less. Nor does how fast a body travels that meets nothing: what has fallen out of the picture would
// halve the steps of all others for ever.
bool outrunsContact(WorldData& d, double time) {
  ContactData& c = d.contact;
  if (c.mode == ContactMode::none) return false;
  const Lanes common = c.statics.empty() ? meanVelocity(d, {0, d.spheres.count}) : splat(0);
  const auto isFast = [&](const BodyRange& r) { return isAnyFast(d, r, common, time); };
  if (std::none_of(d.ranges.begin(), d.ranges.end(), isFast)) return false;
  for (std::size_t b = 0; b < d.ranges.size(); ++b) c.swept[b] = sweptBox(d, d.ranges[b], common, time);
  for (std::size_t b = 0; b < d.ranges.size(); ++b) {
    const BodyRange& r = d.ranges[b];
    if (isFast(r) && (mayMeet(d, b) || isAnyFast(d, r, meanVelocity(d, spheresOf(r)), time))) return true;
  }
  return false;
}

// Explicit substeps are as long as tissue allows, 10 ms where nothing gives. Where a ball outruns what is
// looked at in any case (outrunsContact), all is looked at from as far away as the fastest may close within one, and
// lists go further, too.
static void foreseeReach(WorldData& d) {
  constexpr double kMost = 100;  // m/s: beyond, all would be near all
  ContactData& c = d.contact;
  const double h = d.substep, least = leastReach(d);
  Lanes squared = splat(0);  // of the speeds of those that do
  for (std::size_t i = 0; i < d.spheres.velocity.size(); i += 4) {
    Lanes radius;
    gatherFour(c.ball, i, radius);
    const Lanes3 arm = gatherFour(c.arm, i);  // of the substep before
    const Lanes3 v = gatherFour(d.spheres.velocity, i) + cross(gatherFour(d.spheres.angularVelocity, i), arm);
    const Lanes farthest = splat(0.5 / h) * (splat(least) + radius), speed = dot(v, v);
    squared = larger(squared, masked(isLess(farthest * farthest, speed), speed));
  }
  const double fastest = std::sqrt(largestOfLanes(squared));
  c.reach = std::max(least, std::min(2 * fastest, kMost) * h);
  const bool isFast = c.reach > least;
  const double needed = 2 * c.freeMove + (isFast ? 1.5 * c.reach : least);
  const bool isShort = isFast && c.reach > c.margin - 2 * c.freeMove, isLong = c.margin > 4 * needed;
  if (!isShort && !isLong) return;
  c.margin = needed;
  c.listsAreOld = true;
}

void resolveContacts(WorldData& d) {
  if (d.contact.mode == ContactMode::none) return;
  foreseeReach(d);
  findContacts(d);
  solveContacts(d);
}

}  // namespace medulla
