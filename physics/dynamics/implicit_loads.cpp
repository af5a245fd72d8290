#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "physics/dynamics/contact_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/node_motion.h"
#include "physics/dynamics/point_spring.h"

// Loads at points, inside the system: what they give depends on the motion at the stage's end. A side that would pull
// where it may only push, or drag beyond Coulomb's limit, is decided anew in every iteration (a semismooth Newton
// method).
namespace medulla {

namespace {

using Eigen::Vector3d;

std::array<Vector3d, 3> axesAround(const Vector3d& normal) {
  int least = 0;
  normal.cwiseAbs().minCoeff(&least);
  const Vector3d across = normal.cross(Vector3d::Unit(least)).normalized();
  return {normal, across, normal.cross(across)};
}

void addTerm(ImplicitData& s, int quad, const Vector3d& coefficient) {
  s.rowQuad.push_back(quad);
  s.rowCoefficient.push_back(quadOf(coefficient));
}

// The terms of a node's velocity along `axis`.
void addNodeTerms(const WorldData& d, ImplicitData& s, int node, const HostPoint& host, const Vector3d& axis) {
  if (host.count == 0 && !isSkin(d, node)) addTerm(s, 2 * d.spheres.count + node, axis);
  for (int k = 0; k < host.count; ++k) {
    addTerm(s, 2 * host.spheres[k], host.force[k] * axis);
    addTerm(s, 2 * host.spheres[k] + 1, host.torque[k] * axis);
  }
}

template <class AddTerms>
void addRow(ImplicitData& s, const Vector3d& axis, const AddTerms& addTerms) {
  const auto first = static_cast<int>(s.rowQuad.size());
  addTerms(axis);
  s.rows.push_back(LoadRow{first, static_cast<int>(s.rowQuad.size())});
}

// Arms from the spheres' frames to their balls' centres, the mean of the stage's start and the present state: what a
// turning arm adds to a way is its rate there times the duration, to third order, and its work is that of the gap that
// it opens. And how fast the centres move by them.
void moveBalls(const WorldData& d, ImplicitData& s) {
  s.balls.resize(d.spheres.count);
  for (int i = 0; i < d.spheres.count; ++i) {
    const Vector3d now = quaternionOf(d.spheres.orientation[i]) * vectorOf(d.contact.restBall[i]);
    s.balls[i].arm = quadOf(0.5 * (now + vectorOf(d.contact.arm[i])));
    store(s.balls[i].velocity, load(s.motion[2 * i]) + crossProduct(load(s.motion[2 * i + 1]), load(s.balls[i].arm)));
  }
}

// Of most contacts that are near enough to be looked at nothing else is asked. A point of contact lies along the normal
// from its ball's centre, and moves along it as that does.
bool pushes(const ImplicitData& s, const Contact& c) {
  Lanes velocity = splat(0);
  for (int e = 0; e < c.ends; ++e) velocity = fma(splat(c.weight[e]), load(s.balls[c.sphere[e]].velocity), velocity);
  return dotProduct(velocity, c.normal) + contactBias(c, s.duration) < 0;
}

void addContact(ImplicitData& s, const Contact& c, std::size_t index) {
  const PointLoad load{true, index, axesAround({c.normal[0], c.normal[1], c.normal[2]})};
  std::array<Vector3d, 4> levers;
  for (int e = 0; e < c.ends; ++e) {
    Quad lever;
    store(lever, leverOf(s.balls[c.sphere[e]].arm, c, e));
    levers[e] = vectorOf(lever);
  }
  for (const Vector3d& axis : load.axes)
    addRow(s, axis, [&](const Vector3d& along) {
      for (int e = 0; e < c.ends; ++e) {
        addTerm(s, 2 * static_cast<int>(c.sphere[e]), c.weight[e] * along);
        addTerm(s, 2 * static_cast<int>(c.sphere[e]) + 1, c.weight[e] * levers[e].cross(along));
      }
    });
  s.loads.push_back(load);
}

double rateOf(const ImplicitData& s, const LoadRow& row) {
  double rate = 0;
  for (int k = row.first; k < row.end; ++k) rate += dotProduct(load(s.rowCoefficient[k]), load(s.motion[s.rowQuad[k]]));
  return rate;
}

Vector3d ratesOf(const ImplicitData& s, const LoadRow* rows) {
  return {rateOf(s, rows[0]), rateOf(s, rows[1]), rateOf(s, rows[2])};
}

double workAcross(const ImplicitData& s, const LoadRow* rows) {
  return rows[1].impulse * rateOf(s, rows[1]) + rows[2].impulse * rateOf(s, rows[2]);
}

// Turns the tangents, and the rows along them, by the angle of this cosine and sine.
void turnTangents(ImplicitData& s, PointLoad& load, const LoadRow* rows, double cosine, double sine) {
  const Vector3d first = load.axes[1], second = load.axes[2];
  load.axes[1] = cosine * first + sine * second;
  load.axes[2] = cosine * second - sine * first;
  for (int k = 0; k < rows[1].end - rows[1].first; ++k) {
    Quad &a = s.rowCoefficient[rows[1].first + k], &b = s.rowCoefficient[rows[2].first + k];
    const Lanes along = medulla::load(a), across = medulla::load(b);
    store(a, fma(splat(sine), across, splat(cosine) * along));
    store(b, fnma(splat(sine), along, splat(cosine) * across));
  }
}

// Friction is `wanted`, cut off at `most`. At the limit the derivative of that is (1 - e e^T) most / |wanted| times the
// stiffness of sticking, e the way of the drag: nothing resists along it, and the iteration overshoots to sliding the
// other way, at one contact of a heap or another in every iteration. With foretold e^T / most in place of e e^T it does
// not (Chan, Golub and Mulet 1999, of total variation, which has the same kink; of friction: Stadler 2004): what slides
// on comes to that, what turns about is resisted as by the chord.
Drag& setDrag(ImplicitData& s, std::size_t place, const Vector3d& wanted, double most, const Vector3d& foretoldFirst) {
  Drag& now = s.drags.emplace_back();
  now = {place, wanted, s.isFirstSystem ? foretoldFirst : wanted, most};
  const auto before = std::lower_bound(s.dragsBefore.begin(), s.dragsBefore.end(), place,
                                       [](const Drag& drag, std::size_t at) { return drag.place < at; });
  if (before != s.dragsBefore.end() && before->place == place && before->wanted.norm() > before->most) {
    const double size = before->wanted.norm(), along = before->wanted.dot(wanted - before->wanted) / (size * size);
    now.foretold = before->most / size * wanted - along * before->foretold;
  }
  const double foretold = now.foretold.norm();
  if (foretold > most) now.foretold *= most / foretold;
  return now;
}

// What resists more motion along the drag, and across it, as shares of what resists where it sticks.
struct Resistance {
  double along = 1, across = 1;
};
Resistance resistanceOf(const Drag& drag) {
  const double size = drag.wanted.norm();
  if (size <= drag.most) return {};
  if (!(drag.most > 0)) return {0, 0};
  const double across = drag.most / size, agreed = drag.foretold.dot(drag.wanted) / (drag.most * size);
  return {across * std::min(1.0, 1 - agreed), across};
}

// Friction that holds goes on from what it held with, l0, less what stops the rest of the sliding, s v: what bears a
// weight on a slope does so without creeping. With the energy l^2 / (2 s) l = c (l0 - s v), where c <= 1 is Coulomb's
// limit, is passive: its work is l.v = (l0 - l / c).l / s <= (l0^2 - l^2) / (2 s). Between steps of different durations
// the force stays, not the impulse, and s may change as well: a ledger says what has really been taken in, and
// sumWorkOfLoads() lets no more than that come back.
void settleContact(const WorldData& d, ImplicitData& s, PointLoad& load, LoadRow* rows) {
  const Contact& c = d.contact.contacts[load.index];
  const ContactLaw law = contactLaw(d, c, s.duration);
  const Vector3d rate = ratesOf(s, rows);
  const double wanted = -(rate[0] + law.bias) / law.softness;
  if (!(law.softness > 0 && wanted > 0)) return;
  rows[0].impulse = wanted;
  rows[0].weight = 1 / law.softness;
  const double sticking = 1 / law.softness;
  const Vector3d held = s.held[load.index].impulse;
  const double drag[2] = {load.axes[1].dot(held) - sticking * rate[1], load.axes[2].dot(held) - sticking * rate[2]};
  const double most = c.friction * wanted, whole = std::hypot(drag[0], drag[1]);
  const Drag& asked = setDrag(s, load.index, drag[0] * load.axes[1] + drag[1] * load.axes[2], most, held);
  if (whole > 0) turnTangents(s, load, rows, drag[0] / whole, drag[1] / whole);
  const Resistance resistance = resistanceOf(asked);
  rows[1].impulse = std::min(whole, most);
  rows[1].weight = resistance.along * sticking;
  rows[2].weight = resistance.across * sticking;
}

void settleTool(WorldData& d, ImplicitData& s, const StageLoads& stage, PointLoad& load, LoadRow* rows) {
  const PointSpring p = pointSpring(d, *stage.loads, load.index, stage.time.remaining);
  Vector3d x = Vector3d::Zero();
  for (int i = 0; i < p.count; ++i) x += p.weights[i] * nodePosition(d, p.nodes[i]);
  const Vector3d rate = ratesOf(s, rows);
  constexpr double kSticking = 1e-5;  // m/s: slower slip is dragged by less than Coulomb's friction, and sticks soon
  const double h = s.duration, spring = h * (h * p.stiffness + p.damping);
  Vector3d pull, slip;  // along the axes
  for (int a = 0; a < 3; ++a) {
    slip[a] = load.axes[a].dot(p.anchorVelocity) - rate[a];
    pull[a] = p.stiffness * load.axes[a].dot(p.anchor - x) + p.damping * (load.axes[a].dot(p.slackVelocity) - rate[a]);
  }
  Vector3d force = pull, weight = Vector3d::Constant(spring);
  if (p.outward != nullptr) {
    if (pull[0] > 0) force[0] = weight[0] = 0;
    const Vector3d& drags = p.slides ? slip : pull;
    const double size = std::hypot(drags[1], drags[2]), most = std::max(0.0, p.friction * -pull[0]);
    // A spring up to Coulomb's friction, or a damper that reaches it where sticking ends.
    const double per = p.slides ? most / kSticking : 1, stiff = p.slides ? h * per : spring;
    const std::size_t place = d.contact.contacts.size() + load.index;
    const Drag& asked =
        setDrag(s, place, h * per * (drags[1] * load.axes[1] + drags[2] * load.axes[2]), h * most, Vector3d::Zero());
    if (size > 0) turnTangents(s, load, rows, drags[1] / size, drags[2] / size);
    const Resistance resistance = resistanceOf(asked);
    force[1] = std::min(per * size, most);
    force[2] = 0;
    weight[1] = resistance.along * stiff;
    weight[2] = resistance.across * stiff;
  }
  // Beyond its limit a load is to the system the softer spring that gives as much now.
  const double limited = force.norm() > p.forceMax ? p.forceMax / force.norm() : 1;
  d.loadForces[load.index].setZero();
  for (int a = 0; a < 3; ++a) {
    rows[a].weight = limited * weight[a];
    rows[a].impulse = h * limited * force[a];
    d.loadForces[load.index] += limited * force[a] * load.axes[a];
  }
}

// Those that grow are taken at the stage's end, which is of second order. One that comes at once acts for the part that
// it is there of what the stage stands for: the stages' ends alone would miss up to half a step.
void addDeadLoads(const WorldData& d, ImplicitData& s, const StageLoads& stage) {
  const double until = stage.time.end - s.duration + stage.lasting;
  for (const NodeForce& load : d.deadLoads) {
    const bool atOnce = load.from == load.to;
    const double size = load.force.norm(),
                 share = atOnce ? shareAt(d, load, until, stage.lasting) : shareAt(d, load, stage.time.end, s.duration);
    if (!(share * size > 0)) continue;
    LoadRow row;
    row.first = static_cast<int>(s.rowQuad.size());
    addNodeTerms(d, s, load.node, hostPoint(d, load.node), load.force / size);
    row.end = static_cast<int>(s.rowQuad.size());
    row.impulse = s.duration * share * size;
    s.rows.push_back(row);
  }
}

}  // namespace

// Along the tangents of now, in this stage's time.
void recallFriction(const WorldData& d, ImplicitData& s) {
  s.held.assign(d.contact.contacts.size(), {Vector3d::Zero(), 0});
  auto from = d.contact.held.begin();
  for (std::size_t k = 0; k < s.held.size(); ++k) {
    const Contact& c = d.contact.contacts[k];
    while (from != d.contact.held.end() && from->key < c.key) ++from;
    if (from == d.contact.held.end()) return;
    if (from->key != c.key) continue;
    const Vector3d normal(c.normal[0], c.normal[1], c.normal[2]), whole = s.duration * vectorOf(from->force);
    s.held[k] = {whole - normal.dot(whole) * normal, from->energy};
  }
}

void keepFriction(WorldData& d, const ImplicitData& s) {
  d.contact.held.clear();
  for (std::size_t k = 0; k < s.loads.size() && s.loads[k].isContact; ++k) {
    const LoadRow* rows = &s.rows[3 * k];
    if (!(rows[0].impulse > 0) || hasFailed(s, bodyOf(s, rows[0]))) continue;
    const Vector3d impulse = rows[1].impulse * s.loads[k].axes[1] + rows[2].impulse * s.loads[k].axes[2];
    const double left = std::max(0.0, s.held[s.loads[k].index].energy - workAcross(s, rows));
    d.contact.held.push_back({d.contact.contacts[s.loads[k].index].key, quadOf(impulse / s.duration),
                              std::min(left, 0.5 * impulse.squaredNorm() / rows[0].weight)});
  }
}

void sumWorkOfLoads(ImplicitData& s) {
  std::vector<double>& work = s.workOfLoads;
  std::fill(work.begin(), work.end(), 0);
  for (std::size_t k = 0; k < s.loads.size(); ++k) {
    const LoadRow* rows = &s.rows[3 * k];
    if (isEmpty(rows[0])) continue;
    double& of = work[bodyOf(s, rows[0])];
    const double across = workAcross(s, rows);
    of += rows[0].impulse * rateOf(s, rows[0]);
    of += s.loads[k].isContact ? std::min(across, s.held[s.loads[k].index].energy) : across;
  }
  for (std::size_t k = 3 * s.loads.size(); k < s.rows.size(); ++k)
    if (!isEmpty(s.rows[k])) work[bodyOf(s, s.rows[k])] += s.rows[k].impulse * rateOf(s, s.rows[k]);
}

bool contactPushes(const ImplicitData& s) {
  for (std::size_t k = 0; k < s.loads.size() && s.loads[k].isContact; ++k)
    if (s.rows[3 * k].impulse > 0) return true;
  return false;
}

void evaluateLoads(WorldData& d, ImplicitData& s, const StageLoads& stage) {
  s.rows.clear();
  s.rowQuad.clear();
  s.rowCoefficient.clear();
  s.loads.clear();
  s.drags.clear();
  const std::vector<Contact>& contacts = d.contact.contacts;
  if (!contacts.empty()) moveBalls(d, s);
  for (std::size_t k = 0; k < contacts.size(); ++k)
    if (pushes(s, contacts[k])) addContact(s, contacts[k], k);
  for (std::size_t k = 0; k < d.loadForces.size(); ++k) {
    const PointSpring p = pointSpring(d, *stage.loads, k, stage.time.remaining);
    std::array<HostPoint, 3> hosts;
    for (int i = 0; i < p.count; ++i) hosts[i] = hostPoint(d, p.nodes[i]);
    const PointLoad load{false, k, axesAround(p.outward != nullptr ? *p.outward : Vector3d::UnitX())};
    for (const Vector3d& axis : load.axes)
      addRow(s, axis, [&](const Vector3d& along) {
        for (int i = 0; i < p.count; ++i) addNodeTerms(d, s, p.nodes[i], hosts[i], p.weights[i] * along);
      });
    s.loads.push_back(load);
  }
  for (std::size_t k = 0; k < s.loads.size(); ++k) {
    if (s.loads[k].isContact)
      settleContact(d, s, s.loads[k], &s.rows[3 * k]);
    else
      settleTool(d, s, stage, s.loads[k], &s.rows[3 * k]);
  }
  addDeadLoads(d, s, stage);
  for (const LoadRow& row : s.rows)
    if (row.impulse != 0) addAlong(s, row, -row.impulse, s.residual);
}

}  // namespace medulla
