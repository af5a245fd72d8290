#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "physics/dynamics/angles.h"
#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/whole_motion.h"

// Backward Euler in a stage of duration T from the state (x0, q0, p0, L0): the motion u at its end obeys
//   M u - p0 = T f(x0 + T u, u),   I(q) w - L0 = T tau,   q = exp(T w) q0,
// solved by Newton's iteration.
namespace medulla {

namespace {

using Eigen::Vector3d;

struct Orientation {
  Lanes3 q;
  Lanes w;
};

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

// out = a + f b, three numbers each
void setSum(const Quad& a, double f, const Quad& b, Quad& out) {
  store(out, fma(splat(f), load(b), load(a)));
}

}  // namespace

Lanes3 angularMomenta(const WorldData& d, const ImplicitData& s, std::size_t group) {
  const Rotation r = rotationsFour(d.spheres.orientation, 4 * group);
  const Lanes3 omega = gatherFour(d.spheres.angularVelocity, 4 * group);
  return rotate(r, timesSymmetric(s.inertia[group].entry, rotateBack(r, omega)));
}

void place(WorldData& d, const ImplicitData& s, double time) {
  Spheres& to = d.spheres;
  for (int i = 0; i < to.count; ++i) {
    const Quad& v = s.motion[2 * i];
    setSum(s.start.position[i], time, v, to.position[i]);
    to.velocity[i] = v;
    to.angularVelocity[i] = s.motion[2 * i + 1];
  }
  for (std::size_t i = 0; i < to.orientation.size(); i += 4) {
    Orientation now;
    now.q = gatherFour(s.start.orientation, i, now.w);
    now = turned(now, splat(time) * gatherFour(to.angularVelocity, i));
    storeFour(now.q, now.w, to.orientation, i);
  }
  for (int g = 0; g < d.nodes.dynamicEnd / 4; ++g) {
    d.nodes.velocity[g] = gatherFour(s.motion, 2 * to.count + 4 * g);
    d.nodes.position[g] = fma(splat(time), d.nodes.velocity[g], s.start.nodePosition[g]);
  }
  d.links.unwoundTwist = s.start.unwoundTwist;
}

namespace {

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

// J: twice the energy of the motion that the impulses `at` a body's quads would give its free masses.
template <class Impulse>
double impulseEnergy(const WorldData& d, const BodyRange& range, const Impulse& at) {
  double sum = 0;
  for (const int i : spheresOf(range)) {
    const SphereGroup& g = d.spheres.groups[i / 4];
    const Lanes* e = g.inverseInertia;
    sum += g.inverseMass[i % 4] * at(2 * i).squaredNorm() +
           (e[0][i % 4] + e[1][i % 4] + e[2][i % 4]) / 3 * at(2 * i + 1).squaredNorm();
  }
  for (const int i : range.node)
    if (i < d.nodes.dynamicEnd) sum += d.nodes.inverseMass[i] * at(2 * d.spheres.count + i).squaredNorm();
  return sum;
}

void measureResidual(const WorldData& d, ImplicitData& s) {
  s.left.resize(d.ranges.size());
  for (std::size_t b = 0; b < d.ranges.size(); ++b)
    s.left[b] = impulseEnergy(d, d.ranges[b], [&](int quad) { return vectorOf(s.residual[quad]); });
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
  s.workOfPaths.assign(d.ranges.size(), 0);
  for (const SphereDrive& drive : d.drives)
    s.workOfPaths[s.bodyOf[2 * drive.sphere]] +=
        dotProduct(load(s.residual[2 * drive.sphere]), load(s.motion[2 * drive.sphere]));
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

// A body that turns goes on along arcs. To turn by R in the stage its velocity at r has to be (R - 1) r / T, not w x r;
// and what it has of the stage before, of (1 - R^-1) r / T - w x r, is over. Guessed from the velocities alone a stiff
// body would be stretched by its turning, and a thousandth of such a residual is more than all that acts on it.
void followArcs(WorldData& d, ImplicitData& s) {
  s.turning.assign(d.ranges.size(), 0);
  for (EnergyBalance& e : s.bodies) e.chords = 0;
  if (std::none_of(d.ranges.begin(), d.ranges.end(), canTurn)) return;
  place(d, s, 0);
  d.spheres.angularMomentum = s.start.angularMomentum;
  wholeMotions(d, s.whole);
  for (std::size_t b = 0; b < s.whole.size(); ++b) {
    const BodyRange& range = d.ranges[b];
    if (!canTurn(range)) continue;
    const Pivot pivot = pivotOf(d, static_cast<int>(b));
    const RigidMotion motion = rigidMotionOf(s.whole[b], pivot);
    const double angle = s.duration * motion.spin.norm();
    if (!(angle > 1e-6)) continue;
    s.turning[b] = angle * std::sqrt(std::max(0.0, motion.spin.dot(spinMomentum(s.whole[b], pivot))));
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, motion.spin.normalized()).toRotationMatrix();
    const auto bend = [&](const Eigen::Matrix3d& by, const Vector3d& x) {  // (by - 1) r / T less w x r
      const Vector3d r = x - motion.centre;
      return Vector3d((by * r - r) / s.duration - motion.spin.cross(r));
    };
    const Eigen::Matrix3d back = 2 * Eigen::Matrix3d::Identity() - turn.transpose();
    double had = 0, size = 0;
    visitMasses(d, range, [&](double mass, const Vector3d& x, int quad) {
      const Vector3d before = bend(back, x);
      had += mass * before.dot(vectorOf(s.motion[quad]) - velocityAt(motion, x));
      size += mass * before.squaredNorm();
    });
    const double share = size > 0 ? std::min(1.0, std::max(0.0, had / size)) : 0;
    s.bodies[b].chords = 0.5 * size;
    visitMasses(d, range, [&](double, const Vector3d& x, int quad) {
      s.motion[quad] = quadOf(vectorOf(s.motion[quad]) + bend(turn, x) - share * bend(back, x));
    });
  }
}

// Goes along s.change until the residual is smaller, or the slope along the change, its product with the residual, half
// as steep at most (Matthies and Strang 1979): contacts that open, close and slide make residuals that are not yet
// smaller on the best way there is. `left` becomes the residual's size; false: nothing was found, and all stays.
bool search(WorldData& d, ImplicitData& s, const StageLoads& stage, double& left) {
  constexpr int kTrials = 12;
  constexpr double kFlat = 0.5;
  const double before = left, down = product(s.residual, s.change);
  double low = 0, high = 1, slopeLow = down, slopeHigh = 0, share = 1;
  s.kept = s.motion;
  const auto go = [&](double to) {
    s.motion = s.kept;
    addScaled(to, s.change, s.motion);
    place(d, s, s.duration);
    evaluateResidual(d, s, stage);
    left = residualSize(s);
  };
  for (int k = 0; k < kTrials; ++k) {
    go(share);
    if (left < (1 - 1e-4 * share) * before) return true;
    const double slope = product(s.residual, s.change);
    if (!(down < 0)) {
      share *= 0.5;
      continue;
    }
    if (std::abs(slope) <= -kFlat * down || (share == 1 && slope < 0)) return true;
    if (slope < 0)
      low = share, slopeLow = slope;
    else  // or not finite
      high = share, slopeHigh = slope >= 0 ? slope : std::numeric_limits<double>::infinity();
    const double nearest = 0.1 * (high - low), secant = low - slopeLow * (high - low) / (slopeHigh - slopeLow);
    share = std::max(low + nearest, std::min(secant, high - nearest));
  }
  go(low);  // 0, or short of a kink
  return low > 0;
}

// Rounding stops some iterations of very stiff bodies just short of what is enough: within this.
constexpr double kSettled = 10;

// Of what acts and does no more than accelerations of no account, this share is left at most: all of it left in every
// step, a body under it would rest where it is.
constexpr double kShareOfActing = 1e-3;

// sqrt(J / kg): the residual per mass that accelerations of no account leave.
double leastResidual(const ImplicitData& s) {
  constexpr double kLeastAcceleration = 1e-5;  // m/s2
  return s.duration * kLeastAcceleration;
}

}  // namespace

double restEnergy(const ImplicitData& s, double mass) {
  const double least = kSettled * leastResidual(s);
  return 0.5 * mass * least * least;
}

namespace {

// Contacts stand first.
std::size_t contactsAmong(const std::vector<PointLoad>& loads) {
  const auto isContact = [](const PointLoad& load) { return load.isContact; };
  return std::partition_point(loads.begin(), loads.end(), isContact) - loads.begin();
}

// J: of what overlaps, as the contact's spring stores it.
double energyOf(const WorldData& d, const Contact& c, double duration) {
  const ContactLaw law = contactLaw(d, c, duration);
  return c.gap < 0 && law.softness > 0 ? 0.5 * law.bias / law.softness * c.gap / duration : 0;
}

// J, per body into s.reach: what it has and is led to, its share of what a body has that pushes it, and what contacts
// store.
void setReach(const WorldData& d, ImplicitData& s) {
  s.sums.resize(s.bodies.size());
  for (std::size_t b = 0; b < s.bodies.size(); ++b) s.sums[b] = s.bodies[b].kineticBefore + s.bodies[b].elasticBefore;
  for (const SphereDrive& drive : d.drives) {
    const int body = s.bodyOf[2 * drive.sphere];
    s.sums[body] = std::max(s.sums[body], 0.5 * s.bodyMass[body] * vectorOf(s.motion[2 * drive.sphere]).squaredNorm());
  }
  s.reach = s.sums;
  const auto strike = [&](int by, int body) {
    s.reach[body] = std::max(s.reach[body], s.sums[by] * std::min(1.0, s.bodyMass[body] / s.bodyMass[by]));
  };
  const std::size_t contacts = contactsAmong(s.loads);
  const auto visitContacts = [&](const auto& visit) {
    for (std::size_t k = 0; k < contacts; ++k) {
      const Contact& c = d.contact.contacts[s.loads[k].index];
      visit(c, bodiesOf(d, c.key));
    }
  };
  visitContacts([&](const Contact&, const std::array<int, 2>& body) {
    if (body[1] >= 0) strike(body[1], body[0]), strike(body[0], body[1]);
  });
  visitContacts([&](const Contact& c, const std::array<int, 2>& body) {
    const double stored = energyOf(d, c, s.duration);
    for (const int b : body)
      if (b >= 0) s.reach[b] += stored;
  });
}

// N s: what tools and dead loads give, without contacts.
void sumGiven(const ImplicitData& s, Motion& out) {
  out.assign(s.residual.size(), Quad{});
  for (std::size_t k = 3 * contactsAmong(s.loads); k < s.rows.size(); ++k)
    addAlong(s, s.rows[k], s.rows[k].impulse, out);
}

// From the bodies' residuals where the stage begins: `share` of them, or less. The first guess may be far from anything
// that a body can come to: a contact's is its approach over its softness. Of stiff bodies a thousandth of that is more
// than all their momentum, and left in a step it lets friction push past Coulomb's limit and holds up what falls. So it
// is `share` of the speeds that weight, loads and energy can bring about at most; of what turns and begins along its
// arc, of what acts, of its turning and of its strain.
void setEnough(const WorldData& d, ImplicitData& s, double share) {
  s.enough.resize(s.left.size());
  setReach(d, s);
  sumGiven(s, s.change);
  for (std::size_t b = 0; b < s.left.size(); ++b) {
    const double weight = s.duration * vectorOf(d.gravity).norm() * std::sqrt(s.bodyMass[b]);
    // Of what is free to move: to hold a body at rest takes what rounding leaves of its links' torques, and a
    // thousandth of that no iteration comes to.
    const double acting = weight + std::sqrt(impulseEnergy(d, d.ranges[b], [&](int quad) {
                            const Vector3d free = vectorOf(s.freedom[quad]).cwiseProduct(vectorOf(s.balance[quad]));
                            return Vector3d(vectorOf(s.residual[quad]) - free);
                          }));
    const double given = impulseEnergy(d, d.ranges[b], [&](int quad) { return vectorOf(s.change[quad]); });
    const double most = weight + std::sqrt(given) + std::sqrt(2 * s.reach[b]);
    double size = std::min(std::sqrt(s.left[b]), most), least = leastResidual(s) * std::sqrt(s.bodyMass[b]);
    if (acting > 0) least = std::min(least, kShareOfActing * acting);
    if (s.turning[b] > 0) size = std::min(size, acting + s.turning[b] + std::sqrt(2 * s.bodies[b].elasticBefore));
    const double enough = share * size + least;
    s.enough[b] = enough * enough;
  }
}

// How a step of the iteration is found. The preconditioner alone costs one evaluation of forces instead of three or
// four. Far from the solution the true derivative is not definite, and a way down is worth more than the tangent.
enum class Way { preconditioner, derivative, definite };

// Whether the preconditioner is the derivative but for what vanishes at rest: it knows nodes' neighbours and what
// contacts and tools join in part only.
bool isWhole(const WorldData& d, const ImplicitData& s) {
  return d.nodes.dynamicEnd == 0 && s.rows.empty();
}

bool takeStep(WorldData& d, ImplicitData& s, const StageLoads& stage, Way way, bool goesOn, double& left) {
  constexpr double kSolved = 0.03;
  ++s.solves;
  if (way != Way::preconditioner) {
    s.iterations += solveSystem(d, s, kSolved, way == Way::derivative ? differentiate : applySystem);
    return search(d, s, stage, left);
  }
  solvePreconditioner(d, s, goesOn);
  s.image = s.residual;
  const bool moved = search(d, s, stage, left);
  for (std::size_t k = 0; k < s.motion.size(); ++k) {
    store(s.direction[k], load(s.motion[k]) - load(s.kept[k]));
    store(s.image[k], load(s.residual[k]) - load(s.image[k]));
  }
  return moved;
}

}  // namespace

bool solveStage(WorldData& d, ImplicitData& s, const StageLoads& stage) {
  constexpr int kIterations = 20;
  constexpr double kClose = 0.1, kNear = 0.3;
  const double share = s.duration < d.substep ? 1e-6 : 1e-3;  // of two stages, or one
  if (d.contact.mode != ContactMode::none) {
    findContacts(d);
    recallFriction(d, s);
  }
  s.motion = s.start.motion;
  s.dragsBefore.clear();
  s.isFirstSystem = true;
  followArcs(d, s);
  leadDriven(d, s, stage.time.end);
  place(d, s, s.duration);
  evaluateResidual(d, s, stage);
  setEnough(d, s, share);
  double left = residualSize(s);
  Way way = isWhole(d, s) ? Way::preconditioner : Way::derivative;
  bool hasMoved = true;  // so far that the matrix of before is no longer close
  for (int i = 0; i < kIterations && left > 1; ++i) {
    const double before = left;
    s.dragsBefore = s.drags;
    s.isFirstSystem = false;
    if (hasMoved && !assembleSystem(d, s, way == Way::definite)) {
      way = Way::definite;
      assembleSystem(d, s, true);
    }
    const bool moved = takeStep(d, s, stage, way, i > 0, left);
    hasMoved = way != Way::preconditioner && left > kClose * before;
    if (way == Way::preconditioner && left > kClose * before) {
      way = Way::derivative;
    } else if (left > kNear * before) {
      if (way == Way::definite && !moved) break;
      way = Way::definite;
    }
  }
  return left <= kSettled;
}

}  // namespace medulla
