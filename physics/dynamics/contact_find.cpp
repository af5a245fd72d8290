#include <algorithm>
#include <cmath>

#include "physics/dynamics/contact_stages.h"

namespace medulla {

namespace {

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

void addContact(WorldData& d, std::uint32_t i, std::uint32_t j, double s, double t) {
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
}

}  // namespace

void findPairContacts(WorldData& d, double moved) {
  ContactData& c = d.contact;
  const double reach = c.reach;
  const Lanes farAtList = splat(reach + 2 * moved), near = splat(reach);
  for (const PairGroup& g : c.pairs) {
    const Lanes perhaps = isLess(g.gapAtList, farAtList);
    if (!any(perhaps)) continue;
    const ConeContact closest = closestOfPairs(c, g);
    const int hits = _mm256_movemask_pd(masked(perhaps, isLess(closest.gap, near)));
    for (int k = 0; k < 4; ++k)
      if (hits >> k & 1) addContact(d, g.collider0[k], g.collider1[k], closest.s[k], closest.t[k]);
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

// Two balls that each move by half the reach are looked at before they touch; with half a radius more they overlap by
// that at most before they are, which neither a centre nor the middle of what is thin passes.
bool outrunsContact(const WorldData& d, double time) {
  const ContactData& c = d.contact;
  if (c.mode == ContactMode::none) return false;
  const double half = 0.5 * c.reach;
  for (std::size_t i = 0; i < c.ball.size(); ++i) {
    const Lanes v = load(d.spheres.velocity[i]) + crossProduct(load(d.spheres.angularVelocity[i]), load(c.arm[i]));
    const double farthest = half + 0.5 * c.ball[i].v[3];
    if (time * time * dotProduct(v, v) > farthest * farthest) return true;
  }
  return false;
}

// Explicit substeps are as long as tissue allows, a whole frame where nothing gives: what moves faster than kFastest is
// looked at from as far away as it may close within one, and does not pass what it meets. Lists then go further, too.
static void foreseeReach(WorldData& d) {
  constexpr double kMost = 100;  // m/s: beyond, all would be near all
  ContactData& c = d.contact;
  Lanes squared = splat(0);
  for (std::size_t i = 0; i < d.spheres.velocity.size(); i += 4) {
    const Lanes3 arm = gatherFour(c.arm, i);  // of the substep before
    const Lanes3 v = gatherFour(d.spheres.velocity, i) + cross(gatherFour(d.spheres.angularVelocity, i), arm);
    squared = larger(squared, dot(v, v));
  }
  const double fastest = std::sqrt(std::max(std::max(squared[0], squared[1]), std::max(squared[2], squared[3])));
  const double closing = std::min(2 * fastest, kMost), least = kFastest * d.substep;
  c.reach = std::max(least, closing * d.substep);
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
