#include "app/torture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>

#include "app/interrupt.h"
#include "physics/dynamics/rest_modes.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/dynamics/stages.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/surface_samples.h"

namespace medulla {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Moves all that is free: places by `move`, orientations by `turn`, which also gets the place. Model frame and world
// are the same here.
void disturb(WorldData& d, const std::function<Vector3d(const Vector3d&)>& move,
             const std::function<Quaterniond(const Vector3d&)>& turn) {
  for (int i = 0; i < d.spheres.count; ++i) {
    const Vector3d x = vectorOf(d.spheres.position[i]);
    if (d.spheres.groups[i / 4].freeToTurn[i % 4] > 0) {
      Quad& q = d.spheres.orientation[i];
      const Quaterniond out = (turn(x) * quaternionOf(q)).normalized();
      q = {{out.x(), out.y(), out.z(), out.w()}};
    }
    if (d.spheres.groups[i / 4].inverseMass[i % 4] > 0) d.spheres.position[i] = quadOf(move(x));
  }
  for (int i = 0; i < d.nodes.dynamicEnd; ++i)
    if (d.nodes.inverseMass[i] > 0) setVector(d.nodes.position, i, move(vectorAt(d.nodes.position, i)));
  runStage(d, evaluateLinks);
}

Quaterniond asItWas(const Vector3d&) {
  return Quaterniond::Identity();
}

Vector3d meanPlace(const SoftBodyModel& m, const std::vector<int>& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (const int node : nodes) sum += m.restNodes[node];
  return sum / std::max(1.0, static_cast<double>(nodes.size()));
}

int longestAxis(const Eigen::AlignedBox3d& box) {
  int axis = 0;
  box.sizes().maxCoeff(&axis);
  return axis;
}

// Of the spheres that are held, or of the nodes where links hold no sphere; at rest.
Vector3d heldPlace(const BodyDescription& body) {
  Vector3d sum = Vector3d::Zero();
  if (body.fixed.empty()) return meanPlace(*body.model, body.fixedNodes);
  for (const FixedSphere& f : body.fixed) sum += body.model->spheres[f.sphere].restFrame;
  return sum / static_cast<double>(body.fixed.size());
}

void stretch(WorldData& d, const Eigen::AlignedBox3d& box, double factor) {
  const int axis = longestAxis(box);
  const double held = heldPlace(d.bodies[0])[axis];
  disturb(
      d,
      [&](Vector3d x) {
        x[axis] = held + factor * (x[axis] - held);
        return x;
      },
      asItWas);
}

// In steps small enough for the links to count the turns.
void twist(WorldData& d, const Eigen::AlignedBox3d& box, double turns) {
  const int axis = longestAxis(box), steps = static_cast<int>(std::ceil(64 * turns));
  const auto turn = [&](const Vector3d& x) {
    const double share = (x[axis] - box.min()[axis]) / box.sizes()[axis];
    return Quaterniond(Eigen::AngleAxisd(2 * std::numbers::pi * turns * share / steps, Vector3d::Unit(axis)));
  };
  const auto move = [&](const Vector3d& x) -> Vector3d { return box.center() + turn(x) * (x - box.center()); };
  for (int k = 0; k < steps; ++k) disturb(d, move, turn);
}

void scatter(WorldData& d, const Eigen::AlignedBox3d& box) {
  RandomSequence random{1};
  disturb(
      d,
      [&](const Vector3d&) -> Vector3d {
        Vector3d u;
        for (int axis = 2; axis >= 0; --axis) u[axis] = random.uniform();
        return box.min() + u.cwiseProduct(box.sizes());
      },
      [&](const Vector3d&) {
        const double a = 2 * std::numbers::pi * random.uniform(), b = 2 * std::numbers::pi * random.uniform(),
                     u = random.uniform();
        return Quaterniond(std::sqrt(1 - u) * std::sin(a), std::sqrt(1 - u) * std::cos(a), std::sqrt(u) * std::sin(b),
                           std::sqrt(u) * std::cos(b));
      });
}

void squash(WorldData& d, const Eigen::AlignedBox3d& box, const Vector3d& factors) {
  disturb(
      d, [&](const Vector3d& x) -> Vector3d { return box.center() + factors.cwiseProduct(x - box.center()); }, asItWas);
}

Vector3d mirror(int axis) {
  Vector3d out = Vector3d::Ones();
  out[axis % 3] = -1;
  return out;
}

void turnOver(WorldData& d, const Eigen::AlignedBox3d& box) {
  const Eigen::AngleAxisd askew(0.1, Vector3d(1, 2, 3).normalized());
  const Vector3d factors = mirror(longestAxis(box));
  disturb(
      d, [&](const Vector3d& x) -> Vector3d { return box.center() + askew * factors.cwiseProduct(x - box.center()); },
      asItWas);
}

template <class Change>
void changeNetwork(SoftBodyModel& m, const Change& change) {
  if (!m.identified) return;
  auto network = std::make_shared<IdentifiedNetwork>(*m.identified);
  change(*network);
  m.identified = network;
}

void scaleNetwork(IdentifiedNetwork& n, double s) {
  n.lengthScale *= s;
  for (IdentifiedFrame& f : n.frames) {
    f.restPosition *= s;
    f.volume *= s * s * s;
    f.secondMoment *= std::pow(s, 5);
  }
  for (IdentifiedLink& l : n.links) {
    l.restPoint0 *= s;
    l.restPoint1 *= s;
    l.stiffness *= s;
    for (Vector6d* strain : {&l.strain0, &l.strain1}) *strain *= std::sqrt(s);
  }
  for (std::vector<SkinFrame>& of : n.skin)
    for (SkinFrame& f : of) f.restPoint *= s;
  n.layer.normal /= s;
  n.layer.tangential /= s;
  n.layer.membrane *= s;
}

std::shared_ptr<const SoftBodyModel> scaledModel(const SoftBodyModel& m, double s) {
  auto out = std::make_shared<SoftBodyModel>(m);
  for (Vector3d& x : out->restNodes) x *= s;
  for (FillingSphere& f : out->spheres) {
    for (Vector3d* x : {&f.restFrame, &f.restBallCentre, &f.restLinkEnd}) *x *= s;
    f.radius *= s;
    f.volume *= s * s * s;
    f.secondMoment *= std::pow(s, 5);
  }
  for (ElasticLink& l : out->links) {
    for (LinkSection& section : l.sections) {
      section.area *= s * s;
      for (double* moment : {&section.bendingMomentU, &section.bendingMomentV, &section.torsionConstant})
        *moment *= std::pow(s, 4);
    }
  }
  for (Attachment& a : out->attachments) {
    a.restOffset *= s;
    a.area *= s * s;
    a.volume *= s * s * s;
  }
  changeNetwork(*out, [s](IdentifiedNetwork& n) { scaleNetwork(n, s); });
  return out;
}

void scaleRegion(Region& r, double s) {
  r.box = {s * r.box.min(), s * r.box.max()};
  r.centre *= s;
  r.radius *= s;
  r.distance *= s;
}

// Every other sphere a hundred times as heavy, those between a hundred times as light.
std::shared_ptr<const SoftBodyModel> unevenModel(const SoftBodyModel& m) {
  auto out = std::make_shared<SoftBodyModel>(m);
  for (std::size_t i = 0; i < out->spheres.size(); ++i) {
    const double factor = i % 2 == 0 ? 1e-2 : 1e2;
    out->spheres[i].volume *= factor;
    out->spheres[i].secondMoment *= factor;
  }
  for (Attachment& a : out->attachments) a.volume *= a.massSphere % 2 == 0 ? 1e-2 : 1e2;
  changeNetwork(*out, [](IdentifiedNetwork& n) {
    for (std::size_t i = 0; i < n.frames.size(); ++i) {
      const double factor = i % 2 == 0 ? 1e-2 : 1e2;
      n.frames[i].volume *= factor;
      n.frames[i].secondMoment *= factor;
    }
  });
  return out;
}

// The same body, its nodes in another order.
std::shared_ptr<const SoftBodyModel> shuffledModel(const SoftBodyModel& m, BodyDescription& body) {
  std::vector<int> order(m.restNodes.size()), place(order.size());
  std::iota(order.begin(), order.end(), 0);
  RandomSequence random{2};
  for (std::size_t i = order.size(); i > 1; --i)
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
  auto out = std::make_shared<SoftBodyModel>(m);
  for (std::size_t i = 0; i < order.size(); ++i) {
    place[order[i]] = static_cast<int>(i);
    out->restNodes[i] = m.restNodes[order[i]];
    out->attachments[i] = m.attachments[order[i]];
  }
  for (auto& t : out->triangles)
    for (auto& k : t) k = place[k];
  for (auto& e : out->edges) {
    for (auto& k : e) k = place[k];
    std::sort(e.begin(), e.end());
  }
  std::sort(out->edges.begin(), out->edges.end());
  for (int& node : body.fixedNodes) node = place[node];
  changeNetwork(*out, [&](IdentifiedNetwork& n) {
    // Empty in a model that keeps the formulas.
    for (std::size_t i = 0; i < n.skin.size(); ++i) n.skin[i] = m.identified->skin[order[i]];
    for (FixedPatch& p : n.patches) {
      for (int& node : p.nodes) node = place[node];
      std::sort(p.nodes.begin(), p.nodes.end());
    }
  });
  return out;
}

struct Trial {
  std::string name;
  std::function<void(BodyDescription&)> change;                       // another body
  std::function<void(WorldData&, const Eigen::AlignedBox3d&)> start;  // another state
  std::function<double(double)> path;                                 // m, of a hand on the free end, for 1 s
};

std::function<void(BodyDescription&)> stiffer(double factor) {
  return [factor](BodyDescription& b) { b.tissue.young *= factor; };
}
std::function<void(BodyDescription&)> scaled(double factor) {
  return [factor](BodyDescription& b) {
    b.model = scaledModel(*b.model, factor);
    for (SteeredLinks& steered : b.steered)
      if (steered.where) scaleRegion(*steered.where, factor);
  };
}
void stretchByHalf(WorldData& d, const Eigen::AlignedBox3d& box) {
  stretch(d, box, 1.5);
}

const std::vector<Trial>& trials() {
  static const std::vector<Trial> all = {
      {"random", {}, scatter, {}},
      {"flattened",
       {},
       [](WorldData& d, const auto& box) {
         squash(d, box, {1, 0, 1});
       },
       {}},
      {"point",
       {},
       [](WorldData& d, const auto& box) {
         squash(d, box, {0, 0, 0});
       },
       {}},
      {"stretched_10", {}, [](WorldData& d, const auto& box) { stretch(d, box, 10); }, {}},
      {"twisted_720", {}, [](WorldData& d, const auto& box) { twist(d, box, 2); }, {}},
      {"inverted", {}, [](WorldData& d, const auto& box) { squash(d, box, mirror(longestAxis(box) + 1)); }, {}},
      // Askew: a link turned by exactly 180 degrees does not know which way back.
      {"reversed", {}, [](WorldData& d, const auto& box) { turnOver(d, box); }, {}},
      {"mass_ratio_1e4", [](BodyDescription& b) { b.model = unevenModel(*b.model); }, stretchByHalf, {}},
      {"stiffness_1e-3", stiffer(1e-3), stretchByHalf, {}},
      {"stiffness_1", {}, stretchByHalf, {}},
      {"stiffness_1e2", stiffer(1e2), stretchByHalf, {}},
      {"stiffness_1e4", stiffer(1e4), stretchByHalf, {}},
      {"scale_0.1", scaled(0.1), stretchByHalf, {}},
      {"scale_10", scaled(10), stretchByHalf, {}},
      {"shuffled", [](BodyDescription& b) { b.model = shuffledModel(*b.model, b); }, stretchByHalf, {}},
      {"hand_step", {}, {}, [](double t) { return t > 0.1 ? 0.02 : 0.0; }},
      {"hand_chirp", {}, {}, [](double t) { return 0.01 * std::sin(2 * std::numbers::pi * (1 + 30 * t) * t); }},
      {"hand_jump_5_m/s", {}, {}, [](double t) { return 5 * std::clamp(t - 0.1, 0.0, 0.02); }},
  };
  return all;
}

const Trial& trialOf(const std::string& name) {
  const auto found = std::find_if(trials().begin(), trials().end(), [&](const Trial& t) { return t.name == name; });
  if (found == trials().end()) throw std::runtime_error(fmt::format("no trial is called '{}'", name));
  return *found;
}

// With nothing around it that moves it.
BodyDescription alone(BodyDescription body) {
  body.worldFromModel.setIdentity();
  body.driven.clear();
  body.neighbours.reset();
  body.deadLoads.clear();
  return body;
}

// The body that a trial is about.
BodyDescription bodyOf(const Trial& trial, const BodyDescription& whole) {
  BodyDescription body = alone(whole);
  if (!isHeld(body))
    throw std::runtime_error(fmt::format("body '{}' is not held anywhere: expected a body with <fix>", body.name));
  if (trial.change) trial.change(body);
  return body;
}

double handTimeOf(const Trial& trial) {
  return trial.path ? 1 : 0;
}

// rad/s: of spheres and links, or, where none of these can deform, of the surface.
double slowestMode(const BodyDescription& body) {
  BodyMechanics mechanics = bodyMechanics(body);
  if (const double lowest = lowestFrequency(body, mechanics); lowest > 0) return lowest;
  dampBody(body, mechanics, Integrator::implicit);
  if (mechanics.lowestFrequency > 0) return mechanics.lowestFrequency;
  throw std::runtime_error(fmt::format("all of body '{}' is held: nothing to torture", body.name));
}

// s: until a hundredth of a hundredfold of the body's size is left of its slowest mode, and the hand's second.
double timeOf(const Trial& trial, const BodyDescription& body, double step) {
  constexpr double kDecay = 12, kLeastSteps = 100;
  const double lowest = slowestMode(body);
  return handTimeOf(trial) + std::max(kDecay / (std::max(0.05, body.tissue.damping) * lowest), kLeastSteps * step);
}

double farthestFromRest(const WorldData& d, const BodyDescription& body) {
  double squared = 0;
  for (std::size_t i = 0; i < body.model->restNodes.size(); ++i)
    squared =
        std::max(squared, (vectorAt(d.nodes.position, d.ranges[0].node[i]) - body.model->restNodes[i]).squaredNorm());
  return std::sqrt(squared);
}

// The node that is farthest from what is fixed.
int freeEnd(const BodyDescription& body) {
  const Vector3d held = heldPlace(body);
  int best = 0;
  for (std::size_t i = 0; i < body.model->restNodes.size(); ++i)
    if ((body.model->restNodes[i] - held).squaredNorm() > (body.model->restNodes[best] - held).squaredNorm())
      best = static_cast<int>(i);
  return best;
}

// One step a frame, nothing that acts on it.
World worldOf(const BodyDescription& body, const TortureMethod& method, double step) {
  WorldSettings settings;
  settings.gravity.setZero();
  settings.frameDuration = step;
  settings.substeps = 1;
  settings.integrator = method.integrator;
  settings.order = method.order;
  return World(settings, {body});
}

// Where the trial's hand is at the end of the step to `t`.
Loads handOn(int node, const BodyDescription& body, const Trial& trial, double t, double step) {
  HeldNode hand;
  hand.node = node;
  hand.stiffness = 200;
  hand.anchor = body.model->restNodes[node] + trial.path(t) * Vector3d::UnitY();
  hand.anchorVelocity = (trial.path(t) - trial.path(t - step)) / step * Vector3d::UnitY();
  return {{}, {hand}};
}

}  // namespace

const std::vector<TortureMethod>& tortureMethods() {
  static const std::vector<TortureMethod> all = {{"explicit", Integrator::explicitEuler, 1},
                                                 {"implicit", Integrator::implicit, 1},
                                                 {"implicit_2", Integrator::implicit, 2}};
  return all;
}

std::vector<std::string> tortureTrials() {
  std::vector<std::string> out;
  for (const Trial& t : trials()) out.push_back(t.name);
  return out;
}

double tortureSteps(const BodyDescription& whole, const std::string& trial, double step) {
  const Trial& found = trialOf(trial);
  return std::ceil(timeOf(found, bodyOf(found, whole), step) / step);
}

TortureOutcome torture(const BodyDescription& whole, const TortureMethod& method, const std::string& trial, double step,
                       const std::function<void()>& afterStep) {
  const Trial& found = trialOf(trial);
  const BodyDescription body = bodyOf(found, whole);
  World world = worldOf(body, method, step);
  const Eigen::AlignedBox3d box = boundsOf(body.model->restNodes);
  if (found.start) found.start(world.data(), box);

  TortureOutcome out;
  const double time = timeOf(found, body, step), handTime = handTimeOf(found);
  const double diagonal = box.diagonal().norm();
  const int end = freeEnd(body);
  const auto energy = [&] {
    const Energies e = world.energies();
    return e.kinetic + e.elastic;
  };
  out.startEnergy = out.largestEnergy = energy();
  try {
    while (world.time() < time) {
      checkInterrupt();
      const double t = world.time() + step;
      world.advance(t <= handTime ? handOn(end, body, found, t, step) : Loads{});
      afterStep();
      const double now = energy();
      out.largestEnergy = std::max(out.largestEnergy, now);
      if (t <= handTime) out.startEnergy = out.largestEnergy;
      if (t <= handTime || !(farthestFromRest(world.data(), body) <= 0.01 * diagonal))
        out.recoveredAt.reset();
      else if (!out.recoveredAt)
        out.recoveredAt = world.time();
      else if (world.time() > handTime && now < 1e-6 * out.startEnergy)
        break;
    }
    out.survived = true;
  } catch (const NotFinite&) {
    out.recoveredAt.reset();
    // What a hand gave is no measure of what came of it in one step.
    if (out.largestEnergy == out.startEnergy) out.largestEnergy = std::numeric_limits<double>::infinity();
  }
  return out;
}

double tortureLimit(const BodyDescription& body) {
  return explicitLimit(alone(body));
}

}  // namespace medulla
