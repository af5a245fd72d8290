#include <cmath>
#include <cstddef>

#include "physics/dynamics/angles.h"
#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/point_spring.h"
#include "physics/dynamics/stages.h"
#include "physics/dynamics/whole_motion.h"

// Backward Euler in a stage of duration T from the state (x0, q0, p0, L0): the motion u at its end obeys
//   M u - p0 = T f(x0 + T u, u),   I(q) w - L0 = T tau,   q = exp(T w) q0,
// solved by Newton's iteration. Order 1: one stage. Order 2: the two stages of SDIRK2 (Alexander 1977), L-stable like
// the first: T = g h with g = 1 - 1/sqrt(2), the second from where the first one's velocity and force lead in (1 - g)
// h.
namespace medulla {

namespace {

using Eigen::Vector3d;

constexpr double kGamma = 0.29289321881345248;  // 1 - 1/sqrt(2)

struct Orientation {
  Lanes3 q;
  Lanes w;
};

Orientation gatherOrientations(const std::vector<Quad>& q, std::size_t i) {
  Orientation out;
  out.q = gatherFour(q, i, out.w);
  return out;
}

// exp(turn) q; what does not turn keeps its bits.
Orientation turned(const Orientation& from, const Lanes3& turn) {
  const Lanes zero = splat(0);
  const Lanes angle = squareRoot(dot(turn, turn)), half = splat(0.5) * angle, turns = isLess(zero, angle);
  Lanes c, s;
  quickCosineSine(half, c, s);
  const Lanes3 axis = (s / select(turns, angle, splat(1))) * turn;
  const Lanes3 q = fma(c, from.q, fma(from.w, axis, cross(axis, from.q)));
  const Lanes w = c * from.w - dot(axis, from.q);
  const Lanes scale = splat(1) / squareRoot(fma(w, w, dot(q, q)));
  const Lanes3 unit = scale * q;
  return {{select(turns, unit.x, from.q.x), select(turns, unit.y, from.q.y), select(turns, unit.z, from.q.z)},
          select(turns, scale * w, from.w)};
}

// Of the four spheres of a group as they stand.
Lanes3 angularMomenta(const WorldData& d, const ImplicitData& s, std::size_t group) {
  const Orientation o = gatherOrientations(d.spheres.orientation, 4 * group);
  const Rotation r = rotationOf(o.q, o.w);
  const Lanes3 omega = gatherFour(d.spheres.angularVelocity, 4 * group);
  return rotate(r, timesSymmetric(s.inertia[group].entry, rotateBack(r, omega)));
}

// `visit(sphere, momentum)` of every sphere.
template <class Visit>
void visitAngularMomenta(const WorldData& d, const ImplicitData& s, const Visit& visit) {
  for (int i = 0; i < d.spheres.count; i += 4) {
    const Lanes3 momenta = angularMomenta(d, s, i / 4);
    Lanes l[4] = {momenta.x, momenta.y, momenta.z, splat(0)};
    transpose(l[0], l[1], l[2], l[3]);
    for (int k = 0; k < std::min(4, d.spheres.count - i); ++k) visit(i + k, l[k]);
  }
}

// out = a + f b, three numbers each
void setSum(const Quad& a, double f, const Quad& b, Quad& out) {
  store(out, fma(splat(f), load(b), load(a)));
}

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

// The state that `s.motion` leads to in `time` from the start.
void place(WorldData& d, const ImplicitData& s, double time) {
  Spheres& to = d.spheres;
  for (int i = 0; i < to.count; ++i) {
    const Quad& v = s.motion[2 * i];
    setSum(s.start.position[i], time, v, to.position[i]);
    to.velocity[i] = v;
    to.angularVelocity[i] = s.motion[2 * i + 1];
  }
  for (std::size_t i = 0; i < to.orientation.size(); i += 4) {
    const Orientation now =
        turned(gatherOrientations(s.start.orientation, i), splat(time) * gatherFour(to.angularVelocity, i));
    storeFour(now.q, now.w, to.orientation, i);
  }
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    d.nodes.velocity[g] = gatherFour(s.motion, 2 * to.count + 4 * g);
    d.nodes.position[g] = fma(splat(time), d.nodes.velocity[g], s.start.nodePosition[g]);
  }
  d.links.unwoundTwist = s.start.unwoundTwist;
}

// M u - p0 - T (f - c M u) at the placed state, c the ambient drag, without loads at points.
void balanceForces(WorldData& d, const ImplicitData& s, Motion& out) {
  runStage(d, evaluateForces);
  const Lanes t = splat(s.duration), dragged = splat(1 + s.duration * d.settings.ambientDrag);
  for (int i = 0; i < d.spheres.count; ++i) {
    const Lanes mass = splat(d.spheres.groups[i / 4].mass[i % 4]);
    const Lanes v = dragged * load(s.motion[2 * i]) - load(s.start.motion[2 * i]);
    store(out[2 * i], mass * v - t * load(d.spheres.force[i]));
  }
  visitAngularMomenta(d, s, [&](int i, Lanes momentum) {
    store(out[2 * i + 1], dragged * momentum - load(s.start.angularMomentum[i]) - t * load(d.spheres.torque[i]));
  });
  const Lanes3 fallen = t * splat(d.gravity);
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    const std::size_t k = 2 * static_cast<std::size_t>(d.spheres.count) + 4 * g;
    const Lanes3 gained = dragged * gatherFour(s.motion, k) - gatherFour(s.start.motion, k) - fallen;
    storeFour(loadFour(d.nodes.mass, 4 * g) * gained - t * d.nodes.force[g], out, k);
  }
}

// J: twice the energy of the motion that the residual would give each body's free masses.
void measureResidual(const WorldData& d, ImplicitData& s) {
  s.left.assign(d.ranges.size(), 0);
  for (std::size_t b = 0; b < d.ranges.size(); ++b) {
    for (const int i : spheresOf(d.ranges[b])) {
      const SphereGroup& g = d.spheres.groups[i / 4];
      const Lanes* e = g.inverseInertia;
      s.left[b] += g.inverseMass[i % 4] * vectorOf(s.residual[2 * i]).squaredNorm() +
                   (e[0][i % 4] + e[1][i % 4] + e[2][i % 4]) / 3 * vectorOf(s.residual[2 * i + 1]).squaredNorm();
    }
    for (const int i : d.ranges[b].node)
      if (i < d.nodes.dynamicEnd)
        s.left[b] += d.nodes.inverseMass[i] * vectorOf(s.residual[2 * d.spheres.count + i]).squaredNorm();
  }
}

// 1 where the bodies' residuals together are small enough, each against its own measure: a light body beside a heavy
// one is solved as if it were alone.
double residualSize(const ImplicitData& s) {
  double squared = 0;
  for (std::size_t b = 0; b < s.left.size(); ++b) squared += s.left[b] / s.enough[b];
  return std::sqrt(squared);
}

void evaluateResidual(WorldData& d, ImplicitData& s, const StageLoads& stage) {
  balanceForces(d, s, s.balance);
  s.residual = s.balance;
  evaluateLoads(d, s, stage);
  s.workOfPaths = 0;
  for (const SphereDrive& drive : d.drives)
    s.workOfPaths += dotProduct(load(s.residual[2 * drive.sphere]), load(s.motion[2 * drive.sphere]));
  hold(s.freedom, s.residual);
  measureResidual(d, s);
}

// y = derivative of the residual along x, by a difference of the forces themselves: 10 nm of motion in centimetres
// leave eight digits.
void differentiate(WorldData& d, ImplicitData& s, const Motion& x, Motion& y) {
  constexpr double kMove = 1e-8, kLever = 0.01;  // m
  double fastest = 0;
  for (int i = 0; i < d.spheres.count; ++i)
    fastest = std::max({fastest, vectorOf(x[2 * i]).norm(), kLever * vectorOf(x[2 * i + 1]).norm()});
  for (std::size_t i = 2 * static_cast<std::size_t>(d.spheres.count); i < x.size(); ++i)
    fastest = std::max(fastest, vectorOf(x[i]).norm());
  const double share = kMove / (s.duration * fastest);
  s.kept = s.motion;
  addScaled(share, x, s.motion);
  place(d, s, s.duration);
  balanceForces(d, s, y);
  s.motion = s.kept;
  for (std::size_t i = 0; i < y.size(); ++i) store(y[i], splat(1 / share) * (load(y[i]) - load(s.balance[i])));
  applyRows(s, x, y);
  hold(s.freedom, y);
}

void leadDriven(WorldData& d, ImplicitData& s, double end) {
  driveSpheres(d, end, s.duration);
  for (const SphereDrive& drive : d.drives) s.motion[2 * drive.sphere] = d.spheres.velocity[drive.sphere];
}

// Goes along s.change as far as it makes the residual smaller, which may be nowhere. Returns its size there.
double search(WorldData& d, ImplicitData& s, const StageLoads& stage, double before) {
  constexpr int kHalvings = 12;
  double gone = 0;
  const auto sizeAt = [&](double share) {
    addScaled(share - gone, s.change, s.motion);
    gone = share;
    place(d, s, s.duration);
    evaluateResidual(d, s, stage);
    return residualSize(s);
  };
  double share = 1;
  for (int k = 0; k <= kHalvings; ++k, share *= 0.5) {
    const double left = sizeAt(share);
    if (left < (1 - 1e-4 * share) * before) return left;
  }
  return sizeAt(0);
}

// Rounding stops some iterations of very stiff bodies just short of what is enough: within this.
constexpr double kSettled = 10;

// sqrt(J / kg): the residual per mass that accelerations of no account leave.
double leastResidual(const ImplicitData& s) {
  constexpr double kLeastAcceleration = 1e-5;  // m/s2
  return s.duration * kLeastAcceleration;
}

// J, below which motion is what the iteration leaves open.
double restEnergy(const ImplicitData& s) {
  const double least = kSettled * leastResidual(s);
  return 0.5 * s.totalMass * least * least;
}

// From the bodies' residuals where the stage begins: `share` of them.
void setEnough(ImplicitData& s, double share) {
  s.enough.resize(s.left.size());
  for (std::size_t b = 0; b < s.left.size(); ++b) {
    const double enough = share * std::sqrt(s.left[b]) + leastResidual(s) * std::sqrt(s.bodyMass[b]);
    s.enough[b] = enough * enough;
  }
}

// From the present state, which `s.start` holds, with its momenta there. False where the iteration does not settle.
bool solveStage(WorldData& d, ImplicitData& s, const StageLoads& stage) {
  constexpr int kIterations = 20;
  constexpr double kSolved = 0.03, kClose = 0.1, kNear = 0.3;
  const double share = s.duration < d.substep ? 1e-6 : 1e-3;  // of two stages, or one
  if (d.contact.mode != ContactMode::none) {
    findContacts(d);
    recallFriction(d, s);
  }
  s.motion = s.start.motion;
  leadDriven(d, s, stage.time.end);
  place(d, s, s.duration);
  evaluateResidual(d, s, stage);
  setEnough(s, share);
  double left = residualSize(s);
  Operator derivative = differentiate;
  bool hasMoved = true;  // so far that the matrix of before is no longer close
  for (int i = 0; i < kIterations && left > 1; ++i) {
    const double before = left;
    if (hasMoved) assembleSystem(d, s);
    s.iterations += solveSystem(d, s, kSolved, derivative);
    ++s.solves;
    left = search(d, s, stage, before);
    hasMoved = left > kClose * before;
    // Far from the solution the true derivative is not definite, and a way down is worth more than the tangent.
    if (left > kNear * before) {
      if (derivative == applySystem && !(left < before)) break;
      derivative = applySystem;
    }
  }
  return left <= kSettled;
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
  const double gain = (1 - kGamma) / kGamma;  // p1 - p0 is the force times the first stage's duration
  visitAngularMomenta(d, s, [&](int i, Lanes end) {
    const Lanes start = load(s.start.angularMomentum[i]);
    store(s.start.angularMomentum[i], fma(splat(gain), end - start, start));
  });
  place(d, s, late);
  for (std::size_t i = 0; i < s.motion.size(); ++i) {
    const Lanes start = load(s.start.motion[i]);
    store(s.start.motion[i], fma(splat(gain), load(s.motion[i]) - start, start));
  }
  for (int i = 0; i < d.spheres.count; ++i) {
    s.start.position[i] = d.spheres.position[i];
    s.start.orientation[i] = d.spheres.orientation[i];
  }
  std::copy_n(d.nodes.position.begin(), s.start.nodePosition.size(), s.start.nodePosition.begin());
}

// J
double kineticEnergy(const WorldData& d, const ImplicitData& s) {
  double kinetic = 0;
  visitAngularMomenta(d, s, [&](int i, Lanes momentum) {
    kinetic += d.spheres.groups[i / 4].mass[i % 4] * vectorOf(d.spheres.velocity[i]).squaredNorm() +
               dotProduct(load(d.spheres.angularVelocity[i]), momentum);
  });
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) kinetic += d.nodes.mass[i] * vectorAt(d.nodes.velocity, i).squaredNorm();
  return 0.5 * kinetic;
}

// J: what gravity, loads, contacts and paths give in the last stage, for the time of the whole step.
double workOf(const WorldData& d, const ImplicitData& s) {
  double sum = s.workOfPaths;
  const Vector3d gravity = s.duration * vectorOf(d.gravity);
  for (int i = 0; i < d.spheres.count; ++i)
    sum += d.spheres.groups[i / 4].mass[i % 4] * gravity.dot(vectorOf(s.motion[2 * i]));
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    sum += d.nodes.mass[i] * gravity.dot(vectorOf(s.motion[2 * d.spheres.count + i]));
  sum += workOfLoads(s);
  return d.substep / s.duration * sum;
}

void slowDown(WorldData& d, double share) {
  const Lanes kept = splat(share);
  for (std::vector<Quad>* all : {&d.spheres.velocity, &d.spheres.angularVelocity, &d.spheres.angularMomentum})
    for (Quad& v : *all) store(v, kept * load(v));
  for (Lanes3& v : d.nodes.velocity) v = kept * v;
}

// Puts back the state that `start` holds.
void restore(WorldData& d, const StageStart& start) {
  Spheres& s = d.spheres;
  s.position = start.position;
  s.orientation = start.orientation;
  s.angularMomentum = start.angularMomentum;
  std::copy(start.nodePosition.begin(), start.nodePosition.end(), d.nodes.position.begin());
  d.links.unwoundTwist = start.unwoundTwist;
  for (int i = 0; i < s.count; ++i) {
    s.velocity[i] = start.motion[2 * i];
    s.angularVelocity[i] = start.motion[2 * i + 1];
  }
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) d.nodes.velocity[g] = gatherFour(start.motion, 2 * s.count + 4 * g);
}

void addToolImpulses(const WorldData& d, double time, std::vector<Vector3d>& impulses) {
  for (std::size_t k = 0; k < impulses.size(); ++k) impulses[k] += time * d.loadForces[k];
}

// How a step ended: done; not settled, or with energy from nowhere, or so far that contacts may have been passed;
// or with a contact that pushes in a step of two stages. The state is of no account but where it is done.
enum class Ending { done, failed, touched };

// Gives free bodies back the momenta that a stage of backward Euler loses. The sum of a body's residuals is what
// Newton's iteration left open of its momentum. Its angular momentum shrinks besides, because the step follows
// tangents: forces balance about the places at the step's end, x1, and the momenta p0 that they change were about x0:
// T sum u x p0 in all, for a rigid body turning at w a rate of T w^2.
void keepMomenta(WorldData& d, ImplicitData& s) {
  wholeMotions(d, s.whole);
  for (std::size_t b = 0; b < s.whole.size(); ++b) {
    const BodyRange& r = d.ranges[b];
    if (r.support.freedom != RigidFreedom::all) continue;
    Vector3d linear = Vector3d::Zero(), angular = Vector3d::Zero();
    const auto addLost = [&](double mass, const Vector3d& at, std::size_t quad) {
      const Vector3d residual = vectorOf(s.residual[quad]);
      linear -= residual;
      angular -=
          at.cross(residual) + s.duration * mass * vectorOf(s.motion[quad]).cross(vectorOf(s.start.motion[quad]));
    };
    for (const int i : spheresOf(r)) {
      addLost(d.spheres.groups[i / 4].mass[i % 4], vectorOf(d.spheres.position[i]), 2 * i);
      angular -= vectorOf(s.residual[2 * i + 1]);
    }
    for (const int i : r.node)
      if (i < d.nodes.dynamicEnd)
        addLost(d.nodes.mass[i], vectorAt(d.nodes.position, i), 2 * static_cast<std::size_t>(d.spheres.count) + i);
    addMomenta(d, static_cast<int>(b), s.whole[b], linear, angular);
  }
}

struct StepEnergy {
  double kinetic, elastic;  // J
};

Ending checkEnergy(WorldData& d, const ImplicitData& s, bool twoStages, const StepEnergy& before) {
  // Backward Euler loses energy where the potential is convex; elsewhere this decides. Order 2 swings about it.
  const double given = workOf(d, s), elastic = elasticEnergy(d), kinetic = kineticEnergy(d, s);
  const double sum = before.kinetic + before.elastic, scale = sum + std::abs(given), allowed = sum + given - elastic;
  if (twoStages) return kinetic <= allowed + 0.5 * scale ? Ending::done : Ending::failed;
  if (kinetic <= allowed) return Ending::done;
  // At rest what the iteration leaves open has either sign: such a world stays.
  if (std::max(kinetic, before.kinetic) < restEnergy(s)) {
    restore(d, s.before);
    slowDown(d, 0);
    return Ending::done;
  }
  constexpr double kSlack = 1e-3, kRounding = 1e-13;
  if (!(kinetic <= allowed + kSlack * scale)) return Ending::failed;
  slowDown(d, std::sqrt(std::max(0.0, allowed) / kinetic));
  return allowed > -kRounding * scale ? Ending::done : Ending::failed;
}

// One or two stages from s.before.
Ending attempt(WorldData& d, ImplicitData& s, std::size_t halvings, const Loads& loads, const StepTime& time,
               const StepEnergy& before) {
  // A body far beyond what its links measure may not settle in any step; what loses energy is then good enough.
  constexpr std::size_t kMustSettle = 2;
  const double late = d.substep - s.duration;  // 0 in one stage
  s.start = s.before;
  s.toolImpulses.assign(d.loadForces.size(), Vector3d::Zero());
  const auto solve = [&](const StepTime& end, double lasting) {
    const bool settled = solveStage(d, s, {&loads, end});
    addToolImpulses(d, lasting, s.toolImpulses);
    if (late > 0 && contactPushes(s)) return Ending::touched;
    if (!settled && halvings <= kMustSettle) return Ending::failed;
    return halvings < kDeepest && outrunsContact(d, lasting) ? Ending::failed : Ending::done;
  };
  if (late > 0) {
    const Ending first = solve({time.end - late, time.remaining + late}, late);
    if (first != Ending::done) return first;
    beginSecondStage(d, s, late);
  }
  const Ending last = solve(time, s.duration);
  if (last != Ending::done) return last;
  visitAngularMomenta(d, s, [&](int i, Lanes momentum) { store(d.spheres.angularMomentum[i], momentum); });
  if (late == 0 && kineticEnergy(d, s) > restEnergy(s)) keepMomenta(d, s);
  return checkEnergy(d, s, late > 0, before);
}

// The last resort of a body so deformed that its forces are not the slope of its energy (links shorter than a
// twentieth, or folded to 180 degrees): it moves without speed, as long as it has no more energy than it has ever had,
// or stays. Likewise frames that were a whole turn apart are so no longer.
void creep(WorldData& d, const ImplicitData& s) {
  notePenetration(d.contact);
  d.contact.held.clear();
  if (!(elasticEnergy(d) <= d.mostEnergy)) restore(d, s.before);
  slowDown(d, 0);
  const auto orientation = d.spheres.orientation;
  runStage(d, evaluateForces);
  dropWholeTurns(d);
  runStage(d, evaluateForces);
  if (!(elasticEnergy(d) <= d.mostEnergy)) d.spheres.orientation = orientation;
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
  runStage(d, evaluateForces);
  const StepEnergy before{kineticEnergy(d, s), elasticEnergy(d)};
  d.mostEnergy = std::max(d.mostEnergy, before.kinetic + before.elastic);
  const Ending ending = attempt(d, s, part.halvings, loads, time, before);
  if (ending == Ending::done) {
    keepFriction(d, s);
    notePenetration(d.contact);
    for (std::size_t k = 0; k < d.loadForces.size(); ++k)
      toolImpulse[pointSpring(d, loads, k, time.remaining).tool] += s.toolImpulses[k];
    return;
  }
  if (deepest && part.oneStage) return creep(d, s);
  restore(d, s.before);
  if (deepest || ending == Ending::touched) return advanceBy(d, {part.halvings, true}, loads, time, toolImpulse);
  advanceByHalves(d, part.halvings, loads, time, toolImpulse);
}

}  // namespace

void stepImplicitly(WorldData& d, const Loads& loads, const StepTime& time, std::vector<Vector3d>& toolImpulse) {
  advanceBy(d, {}, loads, time, toolImpulse);
}

}  // namespace medulla
