#include <algorithm>
#include <cmath>
#include <numbers>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/stages.h"

// The impulses of contact: damped elastic springs taken implicitly, one after another in a fixed order (sequential
// impulses; Catto, "Soft constraints", GDC 2011), so that their stiffness does not bound the step. With mass m, omega
// and zeta, a spring k = m omega^2, c = 2 zeta omega m on the gap g obeys at the substep's end
//   lambda / h = -k (g + h v) - c v   <=>   v + beta g + gamma lambda = 0,
//   beta = omega / (2 zeta + h omega),  gamma = 1 / (h m omega (2 zeta + h omega)),
// and lambda >= 0, because contact never pulls.
namespace medulla {

namespace {

// Half a period is one substep: implicit, so that any value is stable, and stiff because a light sphere may have to
// bear a whole heap. What rests on a contact sinks in by acceleration / omega^2, micrometres.
constexpr double kOmegaTimesStep = std::numbers::pi;
// Critical. Restitution comes out as 0.05: tissue does not bounce off tissue.
constexpr double kDampingRatio = 1;
// At least as stiff as so many cubes of the ball's radius of the tissue behind it, E r each. In long steps of light
// spheres the half period alone is softer than that: 1 kN/m for 2.5 g at 5 ms, and seven kilograms press it flat.
constexpr double kOverTissue = 10;
// m/s: bodies that overlap at the start part no faster than this.
constexpr double kPushOutSpeed = 0.2;

constexpr double kBetaTimesStep = kOmegaTimesStep / (2 * kDampingRatio + kOmegaTimesStep);
constexpr double kGammaTimesMass = 1 / (kOmegaTimesStep * (2 * kDampingRatio + kOmegaTimesStep));

// Impulses start from those of the substep before and are passed over until they change by little; what is left is
// taken up in the next substep. Little is meant of the contact's own impulse, or as a speed: by the largest impulse
// anywhere, what lies on top of a stack or beside a heavy body is never settled, and its friction creeps.
constexpr int kPasses = 8;
constexpr double kSettled = 1e-2;  // of its own impulse
constexpr double kStill = 1e-5;    // m/s

// Spheres as contacts see them, at the momenta of this substep: of groups of four that any contact asks for.
void prepareSpheres(WorldData& d) {
  const Spheres& s = d.spheres;
  std::vector<char>& asked = d.contact.groupIsAsked;
  asked.assign(s.groups.size(), 0);
  for (const Contact& c : d.contact.contacts)
    for (int e = 0; e < c.ends; ++e) asked[c.sphere[e] / 4] = 1;
  for (std::size_t g = 0; g < s.groups.size(); ++g) {
    if (!asked[g]) continue;
    const SphereGroup& group = s.groups[g];
    const std::size_t i = 4 * g;
    ContactSphere* out = &d.contact.spheres[i];
    const Rotation r = rotationsFour(s.orientation, i);
    const Lanes3 momentum = gatherFour(s.angularMomentum, i);
    const auto put = [out](const Lanes3& a, Quad& (*place)(ContactSphere&)) {
      scatter(a, splat(0), place(out[0]), place(out[1]), place(out[2]), place(out[3]));
    };
    const auto columnOf = [&](const Lanes3& unit) {
      return group.freeToTurn * rotate(r, timesInverseInertia(group, unit));
    };
    put(rotate(r, timesInverseInertia(group, rotateBack(r, momentum))),
        [](ContactSphere& a) -> Quad& { return a.angularVelocity; });
    put(columnOf({r.x.x, r.y.x, r.z.x}), [](ContactSphere& a) -> Quad& { return a.inverseInertia[0]; });
    put(columnOf({r.x.y, r.y.y, r.z.y}), [](ContactSphere& a) -> Quad& { return a.inverseInertia[1]; });
    put(columnOf({r.x.z, r.y.z, r.z.z}), [](ContactSphere& a) -> Quad& { return a.inverseInertia[2]; });
    for (int k = 0; k < 4; ++k) {
      out[k].arm = d.contact.arm[i + k];
      out[k].velocity = s.velocity[i + k];
      out[k].velocity.v[3] = group.inverseMass[k];
    }
  }
}

MEDULLA_INLINE Lanes timesInverseInertia(const ContactSphere& s, Lanes a) {
  return fma(load(s.inverseInertia[2]), splatLane<2>(a),
             fma(load(s.inverseInertia[1]), splatLane<1>(a), load(s.inverseInertia[0]) * splatLane<0>(a)));
}

// Its w is of no meaning: directions have none.
MEDULLA_INLINE Lanes relativeVelocity(const WorldData& d, const Contact& c) {
  Lanes v = splat(0);
  for (int e = 0; e < c.ends; ++e) {
    const ContactSphere& s = d.contact.spheres[c.sphere[e]];
    v = fma(splat(c.weight[e]), load(s.velocity) + crossProduct(load(s.angularVelocity), leverOf(s.arm, c, e)), v);
  }
  return v;
}

MEDULLA_INLINE void apply(WorldData& d, const Contact& c, Lanes impulse) {
  for (int e = 0; e < c.ends; ++e) {
    ContactSphere& s = d.contact.spheres[c.sphere[e]];
    const Lanes share = splat(c.weight[e]) * impulse, twist = crossProduct(leverOf(s.arm, c, e), share);
    store(s.velocity, fma(splat(s.velocity.v[3]), share, load(s.velocity)));
    addTo(s.angularVelocity, timesInverseInertia(s, twist));
  }
}

// What contacts have made of the spheres' velocities. Angular momenta change by the whole impulses, so that what one
// side gets the other loses, to rounding.
void returnImpulse(WorldData& d, const Contact& c, Lanes impulse) {
  for (int e = 0; e < c.ends; ++e) {
    const std::uint32_t i = c.sphere[e];
    const Lanes share = splat(c.weight[e]) * impulse, twist = crossProduct(leverOf(d.contact.arm[i], c, e), share);
    Quad& l = d.spheres.angularMomentum[i];
    const Lanes turned = splat(d.spheres.groups[i / 4].freeToTurn[i % 4]) * twist;
    store(l, load(l) + turned);
    if (!d.loadForces.empty()) {
      addTo(d.contact.change[i].velocity, splat(d.contact.spheres[i].velocity.v[3]) * share);
      addTo(d.contact.change[i].angularMomentum, turned);
    }
    d.spheres.velocity[i] = d.contact.spheres[i].velocity;
    d.spheres.velocity[i].v[3] = 0;
  }
}

// Relative velocity per impulse along `a`, m/s per N s.
Lanes mobilityAlong(const WorldData& d, const Contact& c, Lanes a) {
  Lanes sum = splat(0);
  for (int e = 0; e < c.ends; ++e) {
    const ContactSphere& s = d.contact.spheres[c.sphere[e]];
    const Lanes lever = leverOf(s.arm, c, e);
    const Lanes spin = timesInverseInertia(s, crossProduct(lever, a));
    const Lanes ofEnd = fma(splat(s.velocity.v[3]), a, crossProduct(spin, lever));
    sum = fma(splat(c.weight[e] * c.weight[e]), ofEnd, sum);
  }
  return sum;
}

// What completes the frame of normal and tangent0.
MEDULLA_INLINE Lanes tangent1(const Contact& c) {
  return crossProduct(c.normal, c.tangent0);
}

// A direction across the normal, and across the coordinate axis that is least along it.
void chooseTangent(Contact& c) {
  const Lanes size = magnitude(c.normal);
  const int axis = size[0] <= size[1] && size[0] <= size[2] ? 0 : size[1] <= size[2] ? 1 : 2;
  Lanes unit = splat(0);
  unit[axis] = 1;
  const Lanes across = crossProduct(c.normal, unit);
  c.tangent0 = across / splat(std::sqrt(dotProduct(across, across)));
}

double closingSpeed(const WorldData& d, const Contact& c) {
  return -dotProduct(relativeVelocity(d, c), c.normal);
}

// Wakes bodies that others, awake, will press on within the substep; whether there was any.
bool wakePressed(WorldData& d) {
  if (d.awake.bodies == static_cast<int>(d.bodies.size())) return false;
  std::vector<int> pressed;
  for (const Contact& c : d.contact.contacts) {
    const auto [a, b] = bodiesOf(d, c.key);
    if (b < 0 || d.rest[a].asleep == d.rest[b].asleep || c.misses) continue;
    if (!(c.gap > d.substep * closingSpeed(d, c))) pressed.push_back(d.rest[a].asleep ? a : b);
  }
  for (const int body : pressed) wake(d, body);
  return !pressed.empty();
}

// Per body, how fast it is struck at most in this substep. A body struck is no faster for it than what strikes it.
void findBlows(WorldData& d) {
  std::vector<double>& blow = d.contact.blow;
  blow.assign(d.bodies.size(), 0);
  for (const Contact& c : d.contact.contacts) {
    const double speed = closingSpeed(d, c);
    if (c.gap > d.substep * speed) continue;
    for (const int body : bodiesOf(d, c.key))
      if (body >= 0) blow[body] = std::max(blow[body], speed);
  }
}

double blowOn(const WorldData& d, const Contact& c) {
  const auto [a, b] = bodiesOf(d, c.key);
  return b < 0 ? d.contact.blow[a] : std::max(d.contact.blow[a], d.contact.blow[b]);
}

// False where nothing can move, or where the two are too slow to meet within the substep, even if one of them is struck
// by a third.
bool prepare(const WorldData& d, Contact& c) {
  const double h = d.substep, speed = c.gap > 0 ? closingSpeed(d, c) : 0;
  if (c.gap > 0 && c.gap > h * (speed + blowOn(d, c))) return false;
  const ContactLaw law = contactLaw(d, c, h);
  c.bias = c.misses ? std::max(law.bias, speed) : law.bias;
  if (!(c.gap > 0)) c.softness = law.softness;  // until they touch: no further than that, and hard
  const Lanes mobility = mobilityAlong(d, c, c.normal);
  const double alongNormal = dotProduct(mobility, c.normal);
  if (!(alongNormal > 0)) return false;
  c.inverseNormal = 1 / (alongNormal + c.softness);
  chooseTangent(c);
  if (c.friction == 0) return true;
  const Lanes across = tangent1(c), mobility0 = mobilityAlong(d, c, c.tangent0),
              mobility1 = mobilityAlong(d, c, across);
  const double k00 = dotProduct(mobility0, c.tangent0), k11 = dotProduct(mobility1, across),
               k01 = dotProduct(mobility0, across), determinant = k00 * k11 - k01 * k01;
  if (!(determinant > 0)) {
    c.friction = 0;
    return true;
  }
  c.tangentMobility[0] = dotProduct(mobility, c.tangent0);
  c.tangentMobility[1] = dotProduct(mobility, across);
  c.inverseTangent[0] = k11 / determinant;
  c.inverseTangent[1] = k00 / determinant;
  c.inverseTangent[2] = -k01 / determinant;
  return true;
}

void limitFriction(Contact& c) {
  const double most = c.friction * c.normalImpulse;
  const double squared = c.tangentImpulse0 * c.tangentImpulse0 + c.tangentImpulse1 * c.tangentImpulse1;
  if (squared <= most * most) return;
  const double scale = most / std::sqrt(squared);
  c.tangentImpulse0 *= scale;
  c.tangentImpulse1 *= scale;
}

Lanes impulseOf(const Contact& c) {
  return fma(splat(c.normalImpulse), c.normal,
             fma(splat(c.tangentImpulse0), c.tangent0, splat(c.tangentImpulse1) * tangent1(c)));
}

// The impulse of the substep before, along the directions of now. Both lists ascend in key.
void startFrom(WorldData& d, const std::vector<CarriedImpulse>& carried) {
  std::size_t k = 0;
  for (Contact& c : d.contact.contacts) {
    while (k < carried.size() && carried[k].key < c.key) ++k;
    if (k == carried.size() || carried[k].key != c.key) continue;
    const Lanes impulse = load(carried[k].impulse);
    c.normalImpulse = std::max(0.0, dotProduct(impulse, c.normal));
    if (c.friction > 0) {
      c.tangentImpulse0 = dotProduct(impulse, c.tangent0);
      c.tangentImpulse1 = dotProduct(impulse, tangent1(c));
      limitFriction(c);
    }
    apply(d, c, impulseOf(c));
  }
}

// One contact's turn: first the normal impulse, then Coulomb's friction, which is what it takes to stop the sliding as
// long as that is no more than friction times the normal impulse. Returns the size of the change, N s.
double settle(WorldData& d, Contact& c) {
  const Lanes v = relativeVelocity(d, c);
  const double wanted =
      c.normalImpulse - (dotProduct(v, c.normal) + c.bias + c.softness * c.normalImpulse) * c.inverseNormal;
  const double next = std::max(0.0, wanted), change = next - c.normalImpulse;
  c.normalImpulse = next;
  Lanes impulse = splat(change) * c.normal;
  double size = std::abs(change);
  if (c.friction > 0) {
    const Lanes across = tangent1(c);
    const double v0 = dotProduct(v, c.tangent0) + change * c.tangentMobility[0],
                 v1 = dotProduct(v, across) + change * c.tangentMobility[1];
    const double before0 = c.tangentImpulse0, before1 = c.tangentImpulse1;
    c.tangentImpulse0 -= c.inverseTangent[0] * v0 + c.inverseTangent[2] * v1;
    c.tangentImpulse1 -= c.inverseTangent[2] * v0 + c.inverseTangent[1] * v1;
    limitFriction(c);
    const double change0 = c.tangentImpulse0 - before0, change1 = c.tangentImpulse1 - before1;
    impulse = fma(splat(change0), c.tangent0, fma(splat(change1), across, impulse));
    size = std::max(size, std::abs(change0) + std::abs(change1));
  }
  if (size > 0) apply(d, c, impulse);
  return size;
}

// A contact's turn comes again only where one of its spheres was changed since: in the last pass, its own change
// included, for friction and the normal impulse are settled one after the other, or in this one. A heap settles nearly
// everywhere in its first pass; what remains is local, and its cost must not be that of passing over all.
void settleAll(WorldData& d) {
  ContactData& c = d.contact;
  c.changedInPass.assign(c.spheres.size(), -1);
  bool changed = true;
  for (signed char pass = 0; pass < kPasses && changed; ++pass) {
    changed = false;
    for (Contact& contact : c.contacts) {
      signed char last = -1;
      for (int e = 0; e < contact.ends; ++e) last = std::max(last, c.changedInPass[contact.sphere[e]]);
      if (last < pass - 1) continue;
      const double change = settle(d, contact);
      if (!(change > std::max(kSettled * contact.normalImpulse, kStill * contact.inverseNormal))) continue;
      for (int e = 0; e < contact.ends; ++e) c.changedInPass[contact.sphere[e]] = pass;
      changed = true;
    }
  }
}

}  // namespace

double contactBias(const Contact& c, double duration) {
  if (c.gap > 0) return c.gap / duration;  // they may come as close as the gap allows
  return std::max(kBetaTimesStep / duration * c.gap, -kPushOutSpeed);
}

ContactLaw contactLaw(const WorldData& d, const Contact& c, double duration) {
  // The spring's mass is that of whole cells. On a full surface most of it sits in nodes that hang elastically on the
  // spheres: the spheres' own would make contacts ten times softer, and what lies on them is the whole.
  double inverseCells = 0, inverseYoung = 0;
  for (int e = 0; e < c.ends; ++e) {
    const double share = c.weight[e] * c.weight[e];
    inverseCells += share * d.contact.inverseCellMass[c.sphere[e]];
    inverseYoung += share * d.contact.inverseYoung[c.sphere[e]];
  }
  const double omega = kOmegaTimesStep / duration;  // of the mass that makes the spring as stiff as tissue asks for
  const double inverseTissue = omega * omega * inverseYoung / (kOverTissue * c.smallerRadius);
  const double softness = kGammaTimesMass * std::min(inverseCells, inverseTissue);
  const double bias = contactBias(c, duration), spring = kBetaTimesStep / duration * c.gap;
  // Where the push out is limited the softness shrinks likewise: the load at which v = 0 stays the spring's, k g.
  return {bias, spring < -kPushOutSpeed ? softness * (bias / spring) : softness};
}

void notePenetration(ContactData& c) {
  for (const Contact& contact : c.contacts) {
    double& largest = contact.key >> 63 ? c.penetration.statics : c.penetration.bodies;
    largest = std::max(largest, -100 * contact.gap / contact.smallerRadius);
  }
}

void solveContacts(WorldData& d) {
  ContactData& c = d.contact;
  if (!d.loadForces.empty()) std::fill(c.change.begin(), c.change.end(), MomentumChange{});
  if (c.contacts.empty()) {
    c.carried.clear();
    return;
  }
  prepareSpheres(d);
  while (wakePressed(d)) {  // who then stands on what bears him, which is no contact while he sleeps
    findContacts(d);
    prepareSpheres(d);
  }
  findBlows(d);
  std::erase_if(c.contacts, [&](Contact& contact) { return !prepare(d, contact); });
  notePenetration(c);
  startFrom(d, c.carried);
  settleAll(d);
  c.carried.clear();
  for (const Contact& contact : c.contacts) {
    const Lanes impulse = impulseOf(contact);
    returnImpulse(d, contact, impulse);
    if (!(contact.normalImpulse > 0)) continue;
    CarriedImpulse& kept = c.carried.emplace_back();
    kept.key = contact.key;
    store(kept.impulse, impulse);
  }
  wakeTouched(d);
}

}  // namespace medulla
