#include <array>
#include <cstddef>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/point_spring.h"
#include "physics/dynamics/stages.h"
#include "physics/dynamics/whole_motion.h"

// Implicit steps. Order 1: one stage of backward Euler (implicit_stage.cpp). Order 2: the two stages of SDIRK2
// (Alexander 1977), L-stable like the first: T = g h with g = 1 - 1/sqrt(2), the second from where the first one's
// velocity and force lead in (1 - g) h.
namespace medulla {

namespace {

using Eigen::Vector3d;

constexpr double kGamma = 0.29289321881345248;  // 1 - 1/sqrt(2)
constexpr double kGain = (1 - kGamma) / kGamma;

// The present state becomes the one that the stage sets out from.
void beginHere(const WorldData& d, StageStart& start) {
  const Spheres& s = d.spheres;
  start.position = s.position;
  start.orientation = s.orientation;
  start.angularMomentum = s.angularMomentum;
  start.nodePosition.assign(d.nodes.position.begin(), d.nodes.position.begin() + d.nodes.dynamicEnd / 4);
  start.unwoundTwist = d.links.unwoundTwist;
  for (int i = 0; i < s.count; ++i) {
    start.motion[2 * i] = s.velocity[i];
    start.motion[2 * i + 1] = s.angularVelocity[i];
  }
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) storeFour(d.nodes.velocity[g], start.motion, 2 * s.count + 4 * g);
}

// Steps of half of the one before at each halving down to kDeepest; in one stage, whatever the order, or as the order
// says. All but the first are made when they are first needed.
constexpr std::size_t kDeepest = 6;
struct Part {
  std::size_t halvings = 0;
  bool oneStage = false;
};
ImplicitData& dataOf(WorldData& d, const Part& part) {
  const bool twoStages = d.settings.order == 2 && !part.oneStage;
  const std::size_t k = d.settings.order == 2 && part.oneStage ? kDeepest + 1 + part.halvings : part.halvings;
  if (d.implicit.size() <= k) d.implicit.resize(k + 1);
  if (d.implicit[k] == nullptr) {
    d.implicit[k] = std::make_shared<ImplicitData>();
    layOutImplicit(d, twoStages ? kGamma * d.substep : d.substep, *d.implicit[k]);
  }
  return *d.implicit[k];
}

// The second stage of SDIRK2 starts from the step's initial state plus (1 - gamma) h times the velocity and the force
// of the first stage.
void beginSecondStage(WorldData& d, ImplicitData& s, double late) {
  // p1 - p0 is the force times the first stage's duration
  visitAngularMomenta(d, s, [&](int i, Lanes end) {
    const Lanes start = load(s.start.angularMomentum[i]);
    store(s.start.angularMomentum[i], fma(splat(kGain), end - start, start));
  });
  place(d, s, late);
  for (std::size_t i = 0; i < s.motion.size(); ++i) {
    const Lanes start = load(s.start.motion[i]);
    store(s.start.motion[i], fma(splat(kGain), load(s.motion[i]) - start, start));
  }
  for (int i = 0; i < d.spheres.count; ++i) {
    s.start.position[i] = d.spheres.position[i];
    s.start.orientation[i] = d.spheres.orientation[i];
  }
  std::copy_n(d.nodes.position.begin(), s.start.nodePosition.size(), s.start.nodePosition.begin());
}

void addToolImpulses(const WorldData& d, double time, std::vector<Vector3d>& impulses) {
  for (std::size_t k = 0; k < impulses.size(); ++k) impulses[k] += time * d.loadForces[k];
}

// How a step ended: done; not settled, or with energy from nowhere, or so far that contacts may have been passed;
// or with a contact that pushes in a step of two stages. The state is of no account but where it is done, or cannot be
// tried again.
enum class Ending { done, failed, touched };

// m/s: of what a body turns about, its centre or its pivot, where its masses move so.
Vector3d leadOf(const BodyRange& r, const Motion& motion, const Vector3d& momentum, double mass) {
  if (isFree(r)) return momentum / mass;
  const int sphere = r.support.point.sphere;
  return sphere >= 0 ? vectorOf(motion[2 * (r.firstSphere + sphere)]) : Vector3d::Zero();
}

// Adds up what a stage takes of the momenta of bodies that turn. The sum of a body's residuals is what Newton's
// iteration left open, `share` of it lasts. Its spin shrinks besides, because the stage follows tangents: forces
// balance about the places at its end, and the momenta p0 that they change were about those at its start; for
// `tangents` s, the sum of u x p0 of motion against the body's own mean motion, or its pivot's, without what is left
// open of that. For a rigid body turning at w, a rate of T w^2.
void noteLost(const WorldData& d, ImplicitData& s, double share, double tangents) {
  for (std::size_t b = 0; b < s.lost.size(); ++b) {
    const BodyRange& r = d.ranges[b];
    if (!canTurn(r)) continue;
    Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero(), turning = Vector3d::Zero();
    Vector3d start = Vector3d::Zero(), end = Vector3d::Zero();  // N s, of the whole body
    double whole = 0;
    visitMasses(d, r, [&](double mass, const Vector3d& at, int quad) {
      const Vector3d residual = vectorOf(s.residual[quad]), u = vectorOf(s.motion[quad]),
                     u0 = vectorOf(s.start.motion[quad]);
      linear += residual;
      angular += at.cross(residual);
      turning += mass * u.cross(u0);
      start += mass * u0;
      end += mass * u;
      whole += mass;
    });
    for (const int i : spheresOf(r)) angular += vectorOf(s.residual[2 * i + 1]);
    const Vector3d lead = leadOf(r, s.motion, end - linear, whole), led = leadOf(r, s.start.motion, start, whole);
    turning += whole * lead.cross(led) - lead.cross(start) - (end - linear).cross(led);
    s.lost[b].linear += share * linear;
    s.lost[b].angular += share * angular + tangents * turning;
  }
}

// A contact's impulse acts at its two ends, on what turns where these are when the stage ends, on what travels where it
// was when the stage began. In the meantime the ends have parted by the slip: a couple, half of which either body has
// too much. `s.whole` is of the stage's end.
void noteCouples(const WorldData& d, ImplicitData& s) {
  for (std::size_t k = 0; k < s.loads.size() && s.loads[k].isContact; ++k) {
    const std::array<int, 2> body = bodiesOf(d, d.contact.contacts[s.loads[k].index].key);
    if (body[1] < 0 || !isFree(d.ranges[body[0]]) || !isFree(d.ranges[body[1]])) continue;
    Vector3d couple = Vector3d::Zero();
    for (const LoadRow* row = &s.rows[3 * k]; row < &s.rows[3 * k] + 3; ++row) {
      for (int t = row->first; t < row->end; t += 2) {  // a sphere's linear and angular velocity
        const WholeMotion& of = s.whole[s.bodyOf[s.rowQuad[t]]];
        const Vector3d at = vectorOf(d.spheres.position[s.rowQuad[t] / 2]) - s.duration / of.mass * of.linear;
        couple += row->impulse * (at.cross(vectorOf(s.rowCoefficient[t])) + vectorOf(s.rowCoefficient[t + 1]));
      }
    }
    for (const int b : body) s.lost[b].angular += 0.5 * couple;
  }
}

// Gives back what was lost.
void keepMomenta(WorldData& d, ImplicitData& s) {
  wholeMotions(d, s.whole);
  noteCouples(d, s);
  for (std::size_t b = 0; b < s.whole.size(); ++b)
    if (canTurn(d.ranges[b])) addMomenta(d, static_cast<int>(b), s.whole[b], -s.lost[b].linear, -s.lost[b].angular);
}

// One or two stages from s.before.
Ending attempt(WorldData& d, ImplicitData& s, std::size_t halvings, const Loads& loads, const StepTime& time) {
  // A body far beyond what its links measure may not settle in any step; what loses energy is then good enough.
  constexpr std::size_t kMustSettle = 2;
  const double late = d.substep - s.duration;  // 0 in one stage
  s.start = s.before;
  s.lost.assign(d.ranges.size(), {Vector3d::Zero(), Vector3d::Zero()});
  s.toolImpulses.assign(d.loadForces.size(), Vector3d::Zero());
  const auto solve = [&](const StepTime& end, double lasting) {
    const bool settled = solveStage(d, s, {&loads, end, lasting});
    addToolImpulses(d, lasting, s.toolImpulses);
    if (late > 0 && contactPushes(s)) return Ending::touched;
    if (!settled && halvings <= kMustSettle) return Ending::failed;
    return halvings < kDeepest && outrunsContact(d, lasting) ? Ending::failed : Ending::done;
  };
  if (late > 0) {
    const Ending first = solve({time.end - late, time.remaining + late}, late);
    if (first != Ending::done) return first;
    // Of p0 + k (p1 - p0), k = (1 - g) / g, at x0 + (1 - g) h u; forces balance about x0 + g h u.
    noteLost(d, s, kGain, late * (2 - kGain));
    beginSecondStage(d, s, late);
  }
  const Ending last = solve(time, s.duration);
  if (last != Ending::done) return last;
  visitAngularMomenta(d, s, [&](int i, Lanes momentum) { store(d.spheres.angularMomentum[i], momentum); });
  noteLost(d, s, 1, s.duration);
  if (kineticEnergy(d, s) > restEnergy(s, s.totalMass)) keepMomenta(d, s);
  return keepEnergy(d, s, late > 0) ? Ending::done : Ending::failed;
}

// What tools gave to bodies whose step did not fail.
void giveToTools(const WorldData& d, const ImplicitData& s, const Loads& loads, const StepTime& time,
                 std::vector<Vector3d>& toolImpulse) {
  for (std::size_t k = 0; k < d.loadForces.size(); ++k) {
    const PointSpring spring = pointSpring(d, loads, k, time.remaining);
    if (!hasFailed(s, d.nodes.groupHosts[spring.nodes[0] / 4].body)) toolImpulse[spring.tool] += s.toolImpulses[k];
  }
}

void advanceBy(WorldData& d, Part part, const Loads& loads, const StepTime& time, std::vector<Vector3d>& toolImpulse);

void advanceByHalves(WorldData& d, std::size_t halvings, const Loads& loads, const StepTime& time,
                     std::vector<Vector3d>& toolImpulse) {
  const double half = 0.5 * d.substep;
  d.substep = half;
  advanceBy(d, {halvings + 1}, loads, {time.end - half, time.remaining + half}, toolImpulse);
  advanceBy(d, {halvings + 1}, loads, time, toolImpulse);
  d.substep = 2 * half;
}

// One step of d.substep; where it fails, two of half of it; where these are the shortest, one of backward Euler's,
// which damps what order 2 would follow. A step in which contacts push is one of backward Euler's too: an impulse that
// stops a ball within the first stage does not last, and led on into the second one it throws the ball back faster than
// it came.
void advanceBy(WorldData& d, Part part, const Loads& loads, const StepTime& time, std::vector<Vector3d>& toolImpulse) {
  const bool deepest = part.halvings == kDeepest;
  if (d.contact.mode != ContactMode::none) placeBalls(d);
  if (!deepest && !part.oneStage && outrunsContact(d, d.substep))
    return advanceByHalves(d, part.halvings, loads, time, toolImpulse);
  part.oneStage = part.oneStage || d.settings.order == 1 || !d.contact.held.empty();
  ImplicitData& s = dataOf(d, part);
  beginHere(d, s.before);
  noteEnergyBefore(d, s);
  const Ending ending = attempt(d, s, part.halvings, loads, time);
  const bool last = deepest && part.oneStage;  // fails by its energy alone
  if (last && ending != Ending::done) creep(d, s);
  if (last || ending == Ending::done) {
    keepFriction(d, s);
    notePenetration(d.contact);
    giveToTools(d, s, loads, time, toolImpulse);
    return;
  }
  restore(d, s.before);
  if (deepest || ending == Ending::touched) return advanceBy(d, {part.halvings, true}, loads, time, toolImpulse);
  advanceByHalves(d, part.halvings, loads, time, toolImpulse);
}

}  // namespace

void stepImplicitly(WorldData& d, const Loads& loads, const StepTime& time, std::vector<Vector3d>& toolImpulse) {
  d.creepsNow = false;
  advanceBy(d, {}, loads, time, toolImpulse);
  d.creep.substeps += d.creepsNow;
}

}  // namespace medulla
