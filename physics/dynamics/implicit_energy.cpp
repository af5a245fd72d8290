#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/stages.h"

// Backward Euler loses energy where the potential is convex; elsewhere, what a step made of energy decides. Nothing but
// contacts that push takes energy from body to body: what these join is an island, and judged by itself.
namespace medulla {

namespace {

using Eigen::Vector3d;

// J, of each body into `sums`.
void sumKineticEnergies(const WorldData& d, const ImplicitData& s, std::vector<double>& sums) {
  sums.assign(d.ranges.size(), 0);
  visitAngularMomenta(d, s, [&](int i, Lanes momentum) {
    sums[s.bodyOf[2 * i]] += d.spheres.groups[i / 4].mass[i % 4] * vectorOf(d.spheres.velocity[i]).squaredNorm() +
                             dotProduct(load(d.spheres.angularVelocity[i]), momentum);
  });
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    sums[s.bodyOf[2 * d.spheres.count + i]] += d.nodes.mass[i] * vectorAt(d.nodes.velocity, i).squaredNorm();
  for (double& sum : sums) sum *= 0.5;
}

void setKinetic(const WorldData& d, ImplicitData& s, double EnergyBalance::*kinetic) {
  sumKineticEnergies(d, s, s.sums);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) s.bodies[b].*kinetic = s.sums[b];
}

void setElastic(const WorldData& d, ImplicitData& s, double EnergyBalance::*elastic) {
  std::fill(s.sums.begin(), s.sums.end(), 0);
  linkEnergy(d, &s.sums);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) s.bodies[b].*elastic = s.sums[b];
  std::fill(s.sums.begin(), s.sums.end(), 0);
  surfaceEnergy(d, &s.sums);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) s.bodies[b].*elastic += s.sums[b];
}

// What gravity, loads, contacts and paths give in the last stage, for the time of the whole step.
void setGiven(const WorldData& d, ImplicitData& s) {
  std::vector<double>& sums = s.sums;
  sums = s.workOfPaths;
  const Vector3d gravity = s.duration * vectorOf(d.gravity);
  for (int i = 0; i < d.spheres.count; ++i)
    sums[s.bodyOf[2 * i]] += d.spheres.groups[i / 4].mass[i % 4] * gravity.dot(vectorOf(s.motion[2 * i]));
  for (int i = 0; i < d.nodes.dynamicEnd; ++i) {
    const int quad = 2 * d.spheres.count + i;
    sums[s.bodyOf[quad]] += d.nodes.mass[i] * gravity.dot(vectorOf(s.motion[quad]));
  }
  sumWorkOfLoads(s);
  for (std::size_t b = 0; b < sums.size(); ++b)
    s.bodies[b].given = d.substep / s.duration * (sums[b] + s.workOfLoads[b]);
}

void joinIslands(ImplicitData& s) {
  s.joined.separate();
  s.isPushed.assign(s.bodies.size(), false);
  for (const LoadRow& row : s.rows) {
    for (int k = row.first; row.impulse != 0 && k < row.end; ++k) {
      const int body = s.bodyOf[s.rowQuad[k]];
      s.joined.join(bodyOf(s, row), body);
      s.isPushed[body] = true;
    }
  }
  for (std::size_t b = 0; b < s.island.size(); ++b) s.island[b] = s.joined.of(int(b));
}

void add(const EnergyBalance& own, EnergyBalance& to) {
  for (double EnergyBalance::*part :
       {&EnergyBalance::kineticBefore, &EnergyBalance::elasticBefore, &EnergyBalance::kinetic, &EnergyBalance::elastic,
        &EnergyBalance::given, &EnergyBalance::chords, &EnergyBalance::mass, &EnergyBalance::most, &EnergyBalance::due,
        &EnergyBalance::mostDue})
    to.*part += own.*part;
}

// Of bodies into islands.
void sumBalances(ImplicitData& s) {
  s.islands.assign(s.bodies.size(), {});
  for (std::size_t b = 0; b < s.bodies.size(); ++b) add(s.bodies[b], s.islands[s.island[b]]);
}

// J: what may be kinetic.
double allowedOf(const EnergyBalance& e) {
  return e.kineticBefore + e.elasticBefore + e.given - e.elastic;
}

constexpr double kSwings = 0.5;

Verdict judge(const ImplicitData& s, const EnergyBalance& e, bool twoStages) {
  const double scale = e.kineticBefore + e.elasticBefore + std::abs(e.given), allowed = allowedOf(e);
  // Order 2 swings about it, but no gain is one to begin the next from.
  if (twoStages) {
    const double most = e.due + e.given + kSwings * e.mostDue + restEnergy(s, e.mass);
    const bool inAll = e.kinetic + e.elastic <= most;
    return inAll && e.kinetic <= allowed + kSwings * scale ? Verdict::passes : Verdict::fails;
  }
  if (e.kinetic <= allowed) return Verdict::passes;
  // At rest what the iteration leaves open has either sign: what rests stays.
  if (std::max(e.kinetic, e.kineticBefore) < restEnergy(s, e.mass)) return Verdict::rests;
  constexpr double kSlack = 1e-3, kRounding = 1e-13;
  // After a shorter step than this one velocities along chords have more of it.
  const bool little = e.kinetic <= allowed + kSlack * scale + e.chords && allowed > -kRounding * scale;
  return little ? Verdict::slows : Verdict::fails;
}

// `visit(group)` of a body's nodes with a motion of their own.
template <class Visit>
void visitNodeGroups(const WorldData& d, int body, const Visit& visit) {
  for (int g = d.ranges[body].firstNodeGroup; g < d.nodes.dynamicEnd / 4 && d.nodes.groupHosts[g].body == body; ++g)
    visit(g);
}

// J, of a body as if it were rigid, but for its travel; with the height of one that turns about a pin.
double energyOfSpin(const WholeMotion& whole, const Pivot& pivot, const Vector3d& gravity) {
  const double spinning = 0.5 * spinMomentum(whole, pivot).dot(rigidMotionOf(whole, pivot).spin);
  return pivot.freedom == RigidFreedom::all ? spinning : spinning - gravity.dot(whole.moment);
}

// Of what turns freely, or about a pin, steps of order 1 bring the axis of least inertia towards its spin, to which
// most energy belongs: the momenta are kept (whole_motion.h), so the gain comes of the body's attitude alone, at the
// rate G = w x L per angle, about a pin less gravity's torque. It is turned back by what takes off `excess` (J). Were
// it slowed instead, what travels and spins would be held back without an outer force: a tube thrown at 60 rad/s lost a
// fifth of its momentum in 3 s. False where that turn is no small one.
bool turnBack(WorldData& d, ImplicitData& s, int body, double excess) {
  constexpr double kMost = 0.1;  // of the step's turn
  constexpr int kRounds = 8;     // of Newton's iteration along the gradient
  constexpr double kRounding = 1e-14;
  const Pivot pivot = pivotOf(d, body);
  if (pivot.freedom == RigidFreedom::aboutLine || !pivot.velocity.isZero(0)) return false;
  const Vector3d gravity = vectorOf(d.gravity);
  double target = 0;
  for (int round = 0; round < kRounds; ++round) {
    wholeMotions(d, s.whole);
    const WholeMotion& whole = s.whole[body];
    const double energy = energyOfSpin(whole, pivot, gravity);
    if (round == 0) target = energy - excess;
    if (energy - target <= kRounding * std::abs(target)) return true;
    const Vector3d spin = rigidMotionOf(whole, pivot).spin;
    Vector3d gradient = spin.cross(spinMomentum(whole, pivot));
    if (pivot.freedom != RigidFreedom::all) gradient -= (whole.moment - whole.mass * pivot.point).cross(gravity);
    const double angle = (energy - target) / gradient.norm();
    if (!(std::abs(angle) < kMost * d.substep * spin.norm())) return false;
    turn(d, body, whole, -angle * gradient.normalized());
  }
  return true;
}

void restore(WorldData& d, const StageStart& start, int body) {
  Spheres& s = d.spheres;
  const BodyRange& r = d.ranges[body];
  for (const int i : spheresOf(r)) {
    s.position[i] = start.position[i];
    s.orientation[i] = start.orientation[i];
    s.angularMomentum[i] = start.angularMomentum[i];
    s.velocity[i] = start.motion[2 * i];
    s.angularVelocity[i] = start.motion[2 * i + 1];
  }
  for (int k = r.firstLink; k < r.firstLink + r.linkCount; ++k)
    d.links.unwoundTwist[k / 4].v[k % 4] = start.unwoundTwist[k / 4].v[k % 4];
  visitNodeGroups(d, body, [&](int g) {
    d.nodes.position[g] = start.nodePosition[g];
    d.nodes.velocity[g] = gatherFour(start.motion, 2 * s.count + 4 * g);
  });
}

// Takes `excess` (J) off what the body does besides moving as if it were rigid. False where that is less.
bool slowWithin(WorldData& d, ImplicitData& s, int body, double excess) {
  const Pivot pivot = pivotOf(d, body);
  if (!pivot.velocity.isZero(0)) return false;
  wholeMotions(d, s.whole);
  const WholeMotion& whole = s.whole[body];
  const RigidMotion rigid = rigidMotionOf(whole, pivot);
  double inner = s.bodies[body].kinetic - 0.5 * spinMomentum(whole, pivot).dot(rigid.spin);
  if (pivot.freedom == RigidFreedom::all) inner -= 0.5 * whole.linear.dot(rigid.velocity);
  if (!(inner > excess)) return false;
  slowDown(d, body, rigid, std::sqrt(1 - excess / inner));
  return true;
}

const RigidMotion kStandstill{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};

void keepEnergyOf(WorldData& d, ImplicitData& s, int body) {
  const EnergyBalance& island = s.islands[s.island[body]];
  if (s.verdicts[body] == Verdict::slows) {
    const double kept = std::max(0.0, allowedOf(island)) / island.kinetic;
    const double excess = (1 - kept) * s.bodies[body].kinetic;
    const bool keepsMomenta = !s.isPushed[body] && canTurn(d.ranges[body]);
    if (!keepsMomenta || (!turnBack(d, s, body, excess) && !slowWithin(d, s, body, excess)))
      slowDown(d, body, kStandstill, std::sqrt(kept));
  }
  if (s.verdicts[body] == Verdict::rests) {
    restore(d, s.before, body);
    slowDown(d, body, kStandstill, 0);
  }
}

// `visit(body)` of those whose island failed with more energy than its bodies ever had.
template <class Visit>
void visitBeyondMost(const WorldData& d, const ImplicitData& s, const Visit& visit) {
  for (int b = 0; b < static_cast<int>(d.ranges.size()); ++b) {
    const EnergyBalance& island = s.islands[s.island[b]];
    if (hasFailed(s, b) && !(island.elastic <= island.most)) visit(b);
  }
}

// What contacts hand over is in no body's own account: of an island each has what it has, and by its mass a share of
// what the island has lost since; where order 2 has swung above what was due, by its energy a share of that.
double dueNow(const EnergyBalance& own, const EnergyBalance& island) {
  if (own.mass == island.mass) return own.due + own.given;
  const double due = island.due + island.given, energy = own.kinetic + own.elastic;
  const double all = island.kinetic + island.elastic;
  return 0 < all && due < all ? energy / all * due : energy + own.mass / island.mass * (due - all);
}

void keepAccountOf(WorldData& d, const ImplicitData& s, int body) {
  if (s.verdicts[body] == Verdict::rests) return;  // it has not moved
  EnergyLedger& ledger = d.ledger[body];
  ledger.due = dueNow(s.bodies[body], s.islands[s.island[body]]);
  ledger.mostDue = std::max(ledger.mostDue, ledger.due);
}

}  // namespace

double kineticEnergy(const WorldData& d, ImplicitData& s) {
  sumKineticEnergies(d, s, s.sums);
  return std::accumulate(s.sums.begin(), s.sums.end(), 0.0);
}

void noteEnergyBefore(WorldData& d, ImplicitData& s) {
  runStage(d, evaluateFramedLinks);
  runStage(d, evaluateAttachments);
  setKinetic(d, s, &EnergyBalance::kineticBefore);
  setElastic(d, s, &EnergyBalance::elasticBefore);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    EnergyBalance& e = s.bodies[b];
    e.mass = s.bodyMass[b];
    EnergyLedger& ledger = d.ledger[b];
    const double energy = e.kineticBefore + e.elasticBefore;
    if (!ledger.begun) ledger = {0, energy, energy, true};
    ledger.most = std::max(ledger.most, energy);
    e.most = ledger.most;
    e.due = ledger.due;
    e.mostDue = ledger.mostDue;
  }
}

bool keepEnergy(WorldData& d, ImplicitData& s, bool twoStages) {
  setKinetic(d, s, &EnergyBalance::kinetic);
  setElastic(d, s, &EnergyBalance::elastic);
  setGiven(d, s);
  joinIslands(s);
  sumBalances(s);
  EnergyBalance world;
  for (const EnergyBalance& island : s.islands) add(island, world);
  // Gains that small are put back for the sake of a world at rest, which is to stay the same to the bit.
  const bool loses = judge(s, world, twoStages) == Verdict::passes;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    const Verdict own = judge(s, s.islands[s.island[b]], twoStages);
    s.verdicts[b] = own == Verdict::rests && loses ? Verdict::passes : own;
  }
  if (std::count(s.verdicts.begin(), s.verdicts.end(), Verdict::fails) > 0) return false;
  for (int b = 0; b < static_cast<int>(s.bodies.size()); ++b) {
    keepEnergyOf(d, s, b);
    keepAccountOf(d, s, b);
  }
  return true;
}

// Of stiff bodies that strike, Newton's iteration may not settle in any step, without a strain that were to blame: it
// is enough that they have no more energy than they should.
static bool isUnstrained(const EnergyBalance& e) {
  constexpr double kLeast = 1e-3;
  return e.elastic <= kLeast * e.kinetic && allowedOf(e) >= 0;
}

// The last resort of a body so deformed that its forces are not the slope of its energy (links shorter than a
// twentieth, or folded to 180 degrees): it moves without speed, as long as it has no more energy than it has ever had,
// or stays; with it, what it pushes. Likewise frames that were a whole turn apart are so no longer.
void creep(WorldData& d, ImplicitData& s) {
  for (int b = 0; b < static_cast<int>(s.bodies.size()); ++b)
    if (hasFailed(s, b) && isUnstrained(s.islands[s.island[b]])) s.verdicts[b] = Verdict::slows;
  visitBeyondMost(d, s, [&](int b) { restore(d, s.before, b); });
  for (int b = 0; b < static_cast<int>(s.bodies.size()); ++b) {
    keepEnergyOf(d, s, b);
    if (!hasFailed(s, b)) {
      keepAccountOf(d, s, b);
      continue;
    }
    slowDown(d, b, kStandstill, 0);
    d.creep.bodies[b] = d.creepsNow = true;
  }
  std::vector<Quad>& orientation = s.start.orientation;  // of no more use in this step
  orientation = d.spheres.orientation;
  runStage(d, evaluateForces);
  for (int b = 0; b < static_cast<int>(s.bodies.size()); ++b)
    if (hasFailed(s, b)) dropWholeTurns(d, b);
  runStage(d, evaluateForces);
  setElastic(d, s, &EnergyBalance::elastic);
  for (int b = 0; b < static_cast<int>(s.bodies.size()); ++b)
    if (hasFailed(s, b)) d.ledger[b].due = std::max(d.ledger[b].due, s.bodies[b].elastic);
  sumBalances(s);
  visitBeyondMost(d, s, [&](int b) {
    for (const int i : spheresOf(d.ranges[b])) d.spheres.orientation[i] = orientation[i];
  });
}

void restore(WorldData& d, const StageStart& start) {
  for (int b = 0; b < static_cast<int>(d.ranges.size()); ++b) restore(d, start, b);
}

}  // namespace medulla
