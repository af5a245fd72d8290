#include <algorithm>

#include "physics/dynamics/anchor.h"
#include "physics/dynamics/identified_stages.h"
#include "physics/dynamics/implicit_stages.h"
#include "physics/dynamics/stages.h"

// The weight of nodes that are carried, whose mass is their spheres' but acts where they hang. What it does to each
// sphere is linear in what is felt, and turns with the sphere: a map that every substep turns. A force and a moment
// that stay for a frame lag behind by half of it, and a moment that lags feeds every swing: at 50 Hz a pendulum gained
// six times its energy in 20 s. Felt is gravity, less what the body falls by as a whole, or one that falls freely would
// begin to turn: the acceleration of its centre, or of what holds it. That of the carried mass alone answers to how the
// spheres swing, who do not answer back: it fed a body on a pin even where nothing lagged.
namespace medulla {

namespace {

Lanes3 alongOf(const WorldData& d, int body) {
  return splat(d.surface.along[body]);
}

// kg times `along` (1), of the four nodes of group g.
MEDULLA_INLINE Lanes3 weightOf(const WorldData& d, const Lanes3& along, int g) {
  return loadFour(d.nodes.mass, 4 * g) * along;
}

void weighOnLink(WorldData& d, const HostRange& range) {
  const LinkHost host = linkHost(d, range.host);
  const Lanes3 along = alongOf(d, range.body);
  AnchorLoads sum = noLoads();
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 weight = weightOf(d, along, g), &offset = d.nodes.offset[g];
    addLoads(host, d.nodes.groups[g], offset, weight, cross(offset, weight), sum);
  }
  setLoads(host, sum, d.surface.weightOnLinks[range.host]);
}

void weighOnSphere(WorldData& d, const HostRange& range) {
  const Lanes3 along = alongOf(d, range.body);
  Lanes3 sum = zeroVectors(), moment = sum;
  for (int g = range.firstGroup; g < range.endGroup; ++g) {
    const Lanes3 weight = weightOf(d, along, g);
    sum = sum + weight;
    moment = moment + cross(d.nodes.offset[g], weight);
  }
  addTo(d.surface.weightAlong[2 * range.host], sumOfLanes(sum));
  addTo(d.surface.weightAlong[2 * range.host + 1], sumOfLanes(moment));
}

void weighOnFrames(WorldData& d, const HostRange& range) {
  const Lanes3 along = alongOf(d, range.body);
  FrameReturn back(d, range);
  for (int g = range.firstGroup; g < range.endGroup; ++g) back.add(g, weightOf(d, along, g), zeroVectors());
  back.finish();
}

void weighAlong(WorldData& d) {
  SurfaceParts& s = d.surface;
  s.weightOnLinks.assign(d.links.loads.size(), LinkLoads{});
  s.weightAlong.assign(2 * d.spheres.position.size(), Quad{});
  for (FrameLoad& load : d.identified.loads) load = {};
  for (const HostRange& range : d.awake.carriedOnLinks) weighOnLink(d, range);
  for (const HostRange& range : d.awake.carriedOnSpheres)
    range.onFrames ? weighOnFrames(d, range) : weighOnSphere(d, range);
  returnLinkLoads(d, s.weightOnLinks, s.weightAlong);
  returnFrameImpulses(d, s.weightAlong);
}

struct OwnAxes {
  Rotation rotation;
  Lanes3 vector;  // of each sphere's body, in the sphere's axes
};
OwnAxes toOwnAxes(const WorldData& d, const std::vector<Quad>& ofBodies, int g) {
  const int* body = &d.spheres.bodyOf[4 * g];
  const Rotation r = rotationsFour(d.spheres.orientation, 4 * g);
  return {r, rotateBack(r, gather(ofBodies[body[0]], ofBodies[body[1]], ofBodies[body[2]], ofBodies[body[3]]))};
}

MEDULLA_INLINE Lanes3 times(const Lanes3* columns, const Lanes3& v) {
  return fma(v.z, columns[2], fma(v.y, columns[1], v.x * columns[0]));
}

// Adds to the map what makes it right `along` v, a unit vector or zero, and changes nothing across (Broyden 1965).
void correct(const Lanes3& right, const Lanes3& v, Lanes3* columns) {
  const Lanes3 lacks = right - times(columns, v);
  columns[0] = fma(v.x, lacks, columns[0]);
  columns[1] = fma(v.y, lacks, columns[1]);
  columns[2] = fma(v.z, lacks, columns[2]);
}

// All of it but what already weighs at the spheres, where the nodes' mass is.
void correctAlong(WorldData& d) {
  SurfaceParts& s = d.surface;
  weighAlong(d);
  for (const Batch& batch : d.awake.batches) {
    for (const int g : batch.sphereGroups) {
      const OwnAxes along = toOwnAxes(d, s.along, g);
      const auto weigh = [&](int part) {
        const Quad* q = &s.weightAlong[8 * g + part];
        return rotateBack(along.rotation, gather(q[0], q[2], q[4], q[6]));
      };
      const Lanes carried = loadFour(s.carriedMass, 4 * g);
      correct(fnma(carried, along.vector, weigh(0)), along.vector, s.carriedWeight[g].force);
      correct(weigh(1), along.vector, s.carriedWeight[g].moment);
    }
  }
}

// Along `direction` of each body; sleepers keep what they have until they wake.
template <class Direction>
void correctAwake(WorldData& d, const Direction& direction) {
  std::vector<Quad>& along = d.surface.along;
  along.assign(d.bodies.size(), Quad{});
  for (const Batch& batch : d.awake.batches)
    for (const int b : batch.bodies) along[b] = quadOf(Eigen::Vector3d(direction(b)));
  correctAlong(d);
}

}  // namespace

void layOutCarriedWeight(WorldData& d) {
  SurfaceParts& s = d.surface;
  if (s.nodes.empty() || vectorOf(d.gravity) == Eigen::Vector3d::Zero()) return;
  s.felt.resize(d.bodies.size());
  s.feltInFrame.resize(d.bodies.size());
  s.feltSubsteps.resize(d.bodies.size());
  s.hanging.assign(d.bodies.size(), d.gravity);
  s.falling.resize(d.bodies.size());
  s.carriedMass.resize(d.spheres.position.size());
  s.carriedWeight.resize(d.spheres.groups.size(), {{zeroVectors(), zeroVectors(), zeroVectors()},
                                                   {zeroVectors(), zeroVectors(), zeroVectors()}});
}

static void sumMasses(WorldData& d) {
  SurfaceParts& s = d.surface;
  s.carriedOf.assign(d.bodies.size(), 0);
  s.massOf.assign(d.bodies.size(), 0);
  for (int i = 0; i < d.spheres.count; ++i) {
    const double mass = d.spheres.groups[i / 4].mass[i % 4];
    s.carriedMass[i] = mass - s.spheres[i].mass;
    s.carriedOf[d.spheres.bodyOf[i]] += s.carriedMass[i];
    s.massOf[d.spheres.bodyOf[i]] += mass;
  }
}

// Deformation alone changes the map in a sphere's axes. What is felt keeps its direction for long: right along it in
// every frame, the map stays right across it from when parts have changed, or from when that was felt.
void weighCarriedNodes(WorldData& d) {
  SurfaceParts& s = d.surface;
  if (s.felt.empty()) return;
  if (s.partsAreNew) {
    sumMasses(d);
    for (int axis = 0; axis < 3; ++axis) correctAwake(d, [axis](int) { return Eigen::Vector3d::Unit(axis); });
    s.partsAreNew = false;
  } else {
    correctAwake(d, [&s](int b) { return vectorOf(s.felt[b]).stableNormalized(); });
  }
}

// m/s, of the centre of a free body's spheres, else of what holds or drives it.
static Lanes fallingVelocity(const WorldData& d, int body) {
  const BodyRange& r = d.ranges[body];
  if (!isFree(r)) {
    const int sphere = r.support.point.sphere;
    return sphere >= 0 ? load(d.spheres.velocity[r.firstSphere + sphere]) : splat(0);
  }
  Lanes momentum = splat(0);
  for (const int i : spheresOf(r))
    momentum = fma(splat(d.spheres.groups[i / 4].mass[i % 4]), load(d.spheres.velocity[i]), momentum);
  return momentum / splat(d.surface.massOf[body]);
}

void rememberFalling(WorldData& d) {
  SurfaceParts& s = d.surface;
  std::fill(s.feltInFrame.begin(), s.feltInFrame.end(), Quad{});
  std::fill(s.feltSubsteps.begin(), s.feltSubsteps.end(), 0);
  for (std::size_t b = 0; b < s.falling.size(); ++b) store(s.falling[b], fallingVelocity(d, static_cast<int>(b)));
}

void feelGravity(WorldData& d, const Batch& batch) {
  SurfaceParts& s = d.surface;
  if (s.felt.empty()) return;
  for (const int b : batch.bodies) {
    const Lanes now = fallingVelocity(d, b);
    const Lanes borne = fnma(splat(d.settings.ambientDrag), now, load(d.gravity));  // the drag acts on all alike
    const Lanes felt = fnma(splat(1 / d.substep), now - load(s.falling[b]), borne);
    store(s.felt[b], felt);
    store(s.feltInFrame[b], load(s.feltInFrame[b]) + felt);
    ++s.feltSubsteps[b];
    store(s.falling[b], now);
  }
}

void hangByFelt(WorldData& d) {
  SurfaceParts& s = d.surface;
  if (s.felt.empty()) return;
  const double most = vectorOf(d.gravity).norm();
  for (const Batch& batch : d.awake.batches)
    for (const int b : batch.bodies) {
      if (s.feltSubsteps[b] == 0) continue;
      const Eigen::Vector3d mean = vectorOf(s.feltInFrame[b]) / s.feltSubsteps[b];
      s.hanging[b] = quadOf(Eigen::Vector3d(mean * (most / std::max(mean.norm(), most))));
    }
}

// Weight that is moved about within a free body leaves no force on the whole, which maps that are turned by spheres
// apart, or are not quite of now, would. What holds a body may bear some of it.
static void balanceForces(WorldData& d, int body) {
  std::vector<Quad>& force = d.spheres.force;
  const std::vector<double>& carried = d.surface.carriedMass;
  const double mass = d.surface.carriedOf[body];
  if (mass == 0) return;
  Lanes sum = splat(0);
  for (const int i : spheresOf(d.ranges[body])) sum = sum + load(force[i]);
  for (const int i : spheresOf(d.ranges[body])) store(force[i], fnma(splat(carried[i] / mass), sum, load(force[i])));
}

void startSphereForces(WorldData& d, const Batch& batch) {
  const SurfaceParts& s = d.surface;
  for (const int g : batch.sphereGroups) {
    if (s.felt.empty()) {
      for (std::vector<Quad>* all : {&d.spheres.force, &d.spheres.torque}) std::fill_n(&(*all)[4 * g], 4, Quad{});
      continue;
    }
    const OwnAxes felt = toOwnAxes(d, s.felt, g);
    storeFour(rotate(felt.rotation, times(s.carriedWeight[g].force, felt.vector)), d.spheres.force, 4 * g);
    storeFour(rotate(felt.rotation, times(s.carriedWeight[g].moment, felt.vector)), d.spheres.torque, 4 * g);
  }
  if (s.felt.empty()) return;
  for (const int b : batch.bodies)
    if (isFree(d.ranges[b])) balanceForces(d, b);
}

}  // namespace medulla
