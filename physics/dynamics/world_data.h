#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/contact_data.h"
#include "physics/dynamics/identified_data.h"
#include "physics/dynamics/point_spring.h"
#include "physics/dynamics/rigid_support.h"
#include "physics/dynamics/simd.h"
#include "physics/dynamics/stage_array.h"
#include "physics/dynamics/world.h"

// The arrays of a world, laid out for AVX2: gathers by index from arrays of quads, arithmetic on four links, springs or
// nodes at once. All bodies share one set of arrays, body after body. Every sum has a fixed order.
namespace medulla {

// ---- Spheres: each batch of bodies padded to a multiple of four; pads have no mass and no links.

struct SphereGroup {        // constants of four spheres
  Lanes mass, inverseMass;  // kg, 1/kg; inverse 0: translation fixed
  Lanes freeToTurn;         // 1, or 0: rotation fixed
  Lanes inverseInertia[6];  // 1/(kg m2), sphere frame: xx, yy, zz, xy, xz, yz
};

inline Eigen::Matrix3d inverseInertiaOf(const SphereGroup& g, int lane) {
  const Lanes* e = g.inverseInertia;
  const double xx = e[0][lane], yy = e[1][lane], zz = e[2][lane], xy = e[3][lane], xz = e[4][lane], yz = e[5][lane];
  return (Eigen::Matrix3d() << xx, xy, xz, xy, yy, yz, xz, yz, zz).finished();
}
// As xx, yy, zz, xy, xz, yz.
inline void setSymmetric(Lanes (&to)[6], int lane, const Eigen::Matrix3d& m) {
  const double entries[6] = {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)};
  for (int e = 0; e < 6; ++e) to[e][lane] = entries[e];
}
inline Eigen::Quaterniond quaternionOf(const Quad& q) {
  return {q.v[3], q.v[0], q.v[1], q.v[2]};
}

// By a symmetric matrix: xx, yy, zz, xy, xz, yz.
inline Lanes3 timesSymmetric(const Lanes (&i)[6], const Lanes3& l) {
  return {fma(i[4], l.z, fma(i[3], l.y, i[0] * l.x)), fma(i[5], l.z, fma(i[1], l.y, i[3] * l.x)),
          fma(i[2], l.z, fma(i[5], l.y, i[4] * l.x))};
}
inline Lanes3 timesInverseInertia(const SphereGroup& g, const Lanes3& l) {
  return timesSymmetric(g.inverseInertia, l);
}

struct Spheres {
  int count = 0;                         // without the pads at the end
  std::vector<Quad> position, velocity;  // m, m/s
  std::vector<Quad> orientation;         // worldFromSphere as x, y, z, w
  std::vector<Quad> angularMomentum;     // kg m2/s, world: conserved to rounding, so this is the state
  std::vector<Quad> angularVelocity;     // rad/s, world; follows from the two above
  std::vector<Quad> force, torque;       // N, N m: sums of the current substep
  std::vector<SphereGroup> groups;
  std::vector<int> bodyOf;           // per sphere; 0 of pads
  std::vector<int> firstSlot, slot;  // the link ends of each sphere: indices into Links::slots, link after link
};

// ---- Links: four at a time; a batch's last group is filled up with copies that have no stiffness and whose slots
// nobody reads.

struct LinkGroup {  // constants of four links
  std::uint32_t sphere0[4], sphere1[4];
  Lanes3 restT, restU;                  // centre line and a section axis at rest, in both spheres' frames
  Lanes restLength, inverseRestLength;  // m, 1/m
  Lanes smallestLength;                 // m; forces divide by no less
  Lanes3 restArm0, restArm1;            // m, sphere frames: from the frame to where the link ends
  bool hasArms;                         // some arm of the four is not zero
  Lanes elongation, torsion;            // N/m, N m/rad
  Lanes flexionU0, flexionV0;           // N m/rad about U, about V, at the end on sphere 0
  Lanes flexionU1, flexionV1;           // on sphere 1
  Lanes coupleU, coupleV;               // between the ends
  Lanes beam;                           // 1, or 0: a spring, linear along, whose nodes keep to its chord
  bool hasBeams;                        // some link of the four is one
  Lanes thinning;                       // twice the Poisson's ratio that what hangs on a beam follows
  Lanes curving;                        // 1/m: Poisson's ratio over twice the rest length, 0 of springs
  Lanes widest;                         // m: twice the longest offset of what hangs on the link
  Lanes relaxation;                     // s, damping over stiffness (Rayleigh's beta)
};

// Sums over what hangs on each of four links of the forces f there, as the link's motions feel them (anchor.h). In N
// and N m.
struct AnchorLoads {
  Lanes3 sum, along, moment;                       // f, along f, offset x f
  Lanes3 bow;                                      // along (1 - along) / 2 f
  Lanes twist;                                     // twistShare of what turns the anchors about n
  Lanes thickness;                                 // offset . f
  Lanes slopeU, slopeV, slopeUAlong, slopeVAlong;  // n.f times the offset's U and V, and along times these
  Lanes curveU, curveV;                            // N m2: f times how the offset moves with the curve
};

// The four links as the surface sees them, and what the surface gives back.
struct LinkFrame {
  Lanes3 origin, line, originVelocity, lineVelocity;  // link end at sphere 0; that at sphere 1 minus it
  Lanes3 arm0, arm1;                                  // m, world: from the spheres' frames to the link's ends
  Lanes3 n, axisU, axisV;  // unit centre line; U, V of sphere 0 carried onto it by the smallest rotation
  Lanes3 turning;          // rad/s, n x n'
  Lanes spin0, spinAlong;  // rad/s about n at sphere 0, and its increase to sphere 1
  Lanes twist;             // rad, from sphere 0 to sphere 1
  Lanes inverseLength;     // 1/m
  Lanes thickness;         // of what hangs on the link, over that at rest
  Lanes thicknessRate;     // 1/s, of its logarithm
  Lanes thicknessSlope;    // 1/m, of its logarithm per length
  Lanes3 spinAxis0, spinAxis1, spinLever0, spinLever1;  // spin_i = spinAxis_i . omega_i - spinLever_i . n'
  // Of beams, and 0 of springs beside them.
  Lanes3 t0, t1;                                   // unit: the rest centre line as the two spheres carry it
  Lanes3 bow, bowVelocity;                         // m, m/s: length (t0 - t1) across the chord
  Lanes slopeU, slopeV, slopeUAlong, slopeVAlong;  // t0 on U and V, and t1's less it
  Lanes slopeURate, slopeVRate, slopeUAlongRate, slopeVAlongRate;  // 1/s
  Lanes curveU, curveV;             // 1/m: nu / 2 times the curvature, over the thickness (anchor.h)
  Lanes curveURate, curveVRate;     // 1/(m s), less what the thickness changes
  Lanes curveEase;                  // 1/m: the curve over the slopes' increase
  Lanes3 force1, torque0, torque1;  // N on sphere 1 (and minus it on sphere 0), N m: elongation and flexion
  Lanes twistMoment;                // N m, of torsion
};

// AnchorLoads of one link, summed over its nodes. Of a link whose nodes do not move by themselves: 0.
struct LinkLoads {
  Quad sumTwist, alongThickness, momentSlopeU, bowSlopeV, slopesAlongCurve;
};

struct Slot {
  Quad force, torque;
};

struct Links {
  int count = 0;
  std::vector<LinkGroup> groups;
  StageArray<LinkFrame> frames;
  std::vector<LinkLoads> loads;    // per link, padded to four
  std::vector<Quad> unwoundTwist;  // rad per link, state: counts turns beyond 180 degrees
  StageArray<Slot> slots;          // 2 per link: end 0, end 1
};

// ---- Surface nodes: sorted by host, each host's range padded to four.

struct NodeGroup {    // constants of four nodes
  Lanes along;        // 0..1 on a link
  Lanes twistShare;   // 0..1 of the link's twist
  Lanes3 restOffset;  // m; on a link (0, component on U, component on V), on a sphere in its frame
  Lanes3 restArea;    // m2, outward, in the offset's frame (on a link: along it, on U, on V); 0 on pads
  Lanes stiffness;    // N/m of the attachment; 0 on pads
  Lanes edges;        // N/m of all edges' springs at the node
};

struct HostRange {
  int host;                  // link or sphere; of nodes on frames, the sphere that they have most of
  int firstGroup, endGroup;  // of its nodes
  double relaxation;         // s, the attachments' damping over stiffness
  int body;
  double bulk;             // N/m5: pressure per volume between these nodes and their anchors
  double largestPressure;  // Pa
  int part;                // place in Nodes::swollen and SurfaceParts::parts; of dynamic nodes
  bool onFrames;           // of an identified body, among those on spheres: each node hangs on frames of its own
  int toConstants;         // from its groups to those of the first like body, which substeps read for both
};

struct GroupHost {
  int host;
  bool onLink;
  int body;
};

struct Nodes {
  int count = 0;  // with pads
  // m, m/s, per group, as all that a node shares with its host's nodes alone. Velocities of skins mean nothing: what
  // acts on them asks their hosts.
  std::vector<Lanes3> position, velocity;
  StageArray<Lanes3> force;               // N, of the current substep, weight apart; dynamic nodes only
  StageArray<Lanes3> offset;              // m, from the anchors' bases to them; of the current substep
  StageArray<Lanes3> area;                // m2, of the surface at rest, carried along; of the current substep
  StageArray<Quad> displaced;             // m, per node: from where the host would carry it; of the current substep
  std::vector<double> swollen;            // m3, per host: between its nodes and their anchors; of the current substep
  std::vector<double> mass, inverseMass;  // kg, 1/kg; 0 on pads and on skin; inverse 0 on fixed nodes
  std::vector<NodeGroup> groups;
  std::vector<GroupHost> groupHosts;
  std::vector<HostRange> onLinks, onSpheres;          // dynamic nodes, first in the arrays
  std::vector<HostRange> skinOnLinks, skinOnSpheres;  // massless nodes, behind them
  int dynamicEnd = 0;                                 // nodes [0, dynamicEnd) are dynamic
};

// Indexed by the range's own groups: the constants of the first like body. A heap of like bodies so streams through the
// caches what moves, and hardly a constant.
inline const NodeGroup* constantsOf(const Nodes& n, const HostRange& range) {
  // As an integer: it may lie before the memory's beginning.
  const std::ptrdiff_t shift = range.toConstants * static_cast<std::ptrdiff_t>(sizeof(NodeGroup));
  const std::uintptr_t first = reinterpret_cast<std::uintptr_t>(n.groups.data()) + shift;
  return reinterpret_cast<const NodeGroup*>(first);  // NOLINT(performance-no-int-to-ptr)
}

// ---- Edge springs between dynamic nodes, each listed at both of its nodes: sums without a store, and no spring waits
// for what another one has just added to its node.

// One spring of each of four nodes of a group. Stiffnesses in single precision, rounded by 6e-8: a substep of 411
// spheres reads more than a second-level cache of 2 MB holds, a fifth of it these, and takes 5 % longer with doubles.
struct alignas(32) SpringGroup {
  std::uint32_t other[4];  // byte offsets into an array of quads, one per node; a node without so many: its own
  float stiffness[4];      // N/m; 0 there
};

struct Springs {
  int count = 0;
  std::vector<SpringGroup> groups;
  std::vector<int> first;  // of each group of nodes, and one beyond
};

// ---- A body's share of the arrays.

struct BodyRange {
  int firstSphere = 0, sphereCount = 0;
  int firstLink = 0, linkCount = 0;
  std::vector<int> node;   // index in Nodes of every model node
  double restVolume = 0;   // m3, enclosed by the rest nodes
  double massDamping = 0;  // 1/s, Rayleigh's alpha
  // 1/s, the same before time 0; at most half of the motion in a substep, as more would ask for shorter ones.
  double settlingDamping = 0;
  double lowestFrequency = 0;  // rad/s, BodyMechanics
  int firstNodeGroup = 0;      // of its nodes, which lie together
  RigidSupport support;        // damped is motion against the rigid motions that it leaves
  int batch = 0;               // bodies of different batches share no group of spheres or links
};
inline bool isFree(const BodyRange& range) {
  return range.support.freedom == RigidFreedom::all;
}
inline bool canTurn(const BodyRange& range) {
  return range.support.freedom != RigidFreedom::none;
}
// Its spheres' numbers, to loop over; std::views::iota is beyond clang++ 14.
struct SphereNumbers {
  struct Iterator {
    int i;
    int operator*() const { return i; }
    Iterator& operator++() { return ++i, *this; }
    bool operator!=(const Iterator& other) const { return i != other.i; }
  };
  int first, past;
  Iterator begin() const { return {first}; }
  Iterator end() const { return {past}; }
};
inline SphereNumbers spheresOf(const BodyRange& r) {
  return {r.firstSphere, r.firstSphere + r.sphereCount};
}

// ---- SurfaceMode::contact: the nodes of a host move by themselves, or they are carried and their mass is the
// spheres'.

struct SurfacePart {            // of one host; part k is that of Nodes::onLinks[k], those on spheres follow
  bool moves = true;            // state: of the groups of nodes that have the choice
  int quietFrames = 0;          // in a row, in which nothing asked for it; state
  bool isShifted = false;       // by edges, while it does not move: SurfaceParts::shift is not 0
  int firstChoice = 0;          // groups of nodes before it always move: another surface mode, or fixed nodes in them
  bool always = true;           // all groups do
  std::vector<int> neighbours;  // parts that edges join to this one, itself included
  double unrest = 0;            // m: it moves where its neighbours' edges would shift a node of it by more
  double heldBulk = 0;          // N/m5: HostRange::bulk where the groups that have the choice hang still and give way
  bool isWanted = false, isBeside = false;  // while parts are chosen: it is to move; it is beside one that moves
  double shifted = 0;                       // m, likewise: by how much its nodes that move are
};

// A sphere without any node's mass, kg and kg m2 in its frame; what a carried node adds.
struct BareSphere {
  double mass = 0;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
};
struct CarriedNode {
  int part, sphere;
  BareSphere mass;
};

struct AttachmentGive {        // of four nodes' attachments alone
  Lanes perForce, perGravity;  // m/N, and m per m/s2
};

// kg and kg m, of four spheres, columns in their own axes: the force and the moment that carried nodes add per m/s2 of
// `felt` along each axis, for not hanging at the spheres' frames.
struct CarriedWeight {
  Lanes3 force[3], moment[3];
};

struct SurfaceParts {
  std::vector<SurfacePart> parts;
  std::vector<int> ofGroup;          // per group of dynamic nodes
  std::vector<AttachmentGive> give;  // per group of dynamic nodes
  std::vector<Quad> shift;           // m, per node: from where it would hang still by itself
  // Of what carried nodes weigh; `felt` is empty where nothing is carried or has weight. Per body: m/s2, gravity less
  // how the body fell faster in the last substep; their sum over a frame, and what carried nodes hang under, the mean
  // of the last frame; m/s, how fast it falls as a whole.
  std::vector<Quad> felt, feltInFrame, hanging, falling;
  std::vector<int> feltSubsteps;             // per body, of the frame: what wakes in it has felt some
  std::vector<CarriedWeight> carriedWeight;  // per group of spheres
  std::vector<double> carriedMass;           // kg, per sphere
  std::vector<double> carriedOf, massOf;     // kg, per body: sums of the above, and of its spheres with it
  bool partsAreNew = true;                   // since `carriedWeight` was found
  // While it is found, under 1 m/s2 `along` a direction per body; N and N m, two per sphere.
  std::vector<Quad> along, weightAlong;
  std::vector<LinkLoads> weightOnLinks;
  std::vector<BareSphere> spheres;
  std::vector<double> ownShare;   // per sphere: of its mass now, without what carried nodes add
  std::vector<double> ownMoment;  // kg m2, per sphere: the least moment of inertia of its own; 0 where it does not turn
  std::vector<CarriedNode> nodes;  // of parts that have the choice; by sphere
};

inline bool isCarried(const SurfaceParts& s, int group) {
  const SurfacePart& part = s.parts[s.ofGroup[group]];
  return !part.moves && group >= part.firstChoice;
}

// ---- Bodies at rest sleep: nothing of them is evaluated until they wake.

struct Rest {  // of a body; state
  bool asleep = false;
  int stillFrames = 0;  // in a row, with every sphere near where it was at the first of them
};

struct StillPlace {  // where a sphere was at the first frame of Rest::stillFrames
  Quad position, orientation;
};

// J, kinetic and elastic; state. `due` is what a body had at first and all that it was given since, as if it had lost
// nothing. `begun`: of no account before its first step, nor before it is driven.
struct EnergyLedger {
  double most = 0;  // at the beginning of any step so far
  double due = 0, mostDue = 0;
  bool begun = false;
};

// What a stage runs over: all that belongs to some bodies awake, in the arrays' order. Up to the contacts, a substep
// takes one batch after the other through all its stages: a world outgrows a core's own cache, and each stage would
// fetch everything anew.
struct Batch {
  std::vector<int> bodies, spheres, sphereGroups, linkGroups, nodeGroups;  // groups: with anything awake in them
  std::vector<int> framedLinkGroups, bareLinkGroups;  // linkGroups: with and without frames that substeps ask for
  std::vector<int> hostLinkGroups;                    // linkGroups: that nodes hang on, whether they move or not
  std::vector<HostRange> onLinks, onSpheres;
  bool sharesStages = false;  // nothing that its stages leave is asked for between them (StageArray)
};

struct Awake {
  int bodies = 0;
  std::vector<Batch> batches;
  std::vector<HostRange> skinOnLinks, skinOnSpheres, carriedOnLinks, carriedOnSpheres;  // as they hang at frames' ends
  std::vector<char> loadedSkins;  // per body: a skin, and loads act on its nodes in this frame
};

// A driven sphere; DrivenSphere with everything in world units.
struct SphereDrive {
  int body = 0, sphere = 0;
  Quad rest, velocity, swing;  // m, m/s, m: axis times amplitude
  double frequency = 0, phase = 0;
};

// All dead loads of one course in time on a node, by its index in Nodes.
struct NodeForce {
  int node = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // N, whole
  double from = 0, to = 0;                          // s
};

// Dead loads on skins, by what carries these: an explicit substep gives them to the spheres host by host.
struct LoadedGroup {
  int group;     // of four nodes
  Lanes3 force;  // N, at present
};
struct LoadedHost {
  enum class Kind { frames, link, sphere } kind;
  int host;        // in Identified::hosts, or link, or sphere
  int first, end;  // in SkinLoads::groups
};
struct SkinLoads {
  std::vector<LoadedGroup> groups;
  std::vector<LoadedHost> hosts;
  std::vector<int> groupOfLoad;  // per dead load: in `groups`; -1 of nodes with masses
};

struct ImplicitData;  // implicit_data.h

struct WorldData {
  WorldSettings settings;
  std::vector<BodyDescription> bodies;
  std::vector<BodyRange> ranges;

  Spheres spheres;
  Links links;
  Nodes nodes;
  Springs springs;
  Identified identified;
  SurfaceParts surface;
  std::vector<Rest> rest;                // per body
  std::vector<BodyMechanics> mechanics;  // per body: what it was laid out by
  std::vector<StillPlace> stillPlace;    // per sphere; state
  Awake awake;
  std::vector<SphereDrive> drives;
  std::vector<NodeForce> deadLoads;  // body after body, in the order described
  SkinLoads skinLoads;
  ContactData contact;
  std::vector<std::shared_ptr<ImplicitData>> implicit;  // per halving of the step; made when it is first needed
  std::vector<EnergyLedger> ledger;                     // per body; of implicit steps
  CreepReport creep;
  bool creepsNow = false;  // some body, in the present substep

  // Force of each tool load in the current substep, tool springs first, then held nodes.
  std::vector<Eigen::Vector3d> loadForces;
  std::vector<Eigen::Vector3d> loadForcesBefore;  // of the frame before; carryLoadForces() alone uses them
  std::vector<SettlingSpring> settling;           // the loads of the current substep

  Quad gravity;
  int substeps = 1;
  double substep = 0;        // s
  double keptByDrag = 1;     // of velocities, and of impulses, in an explicit substep under ambient drag
  double stableSubstep = 0;  // s
  std::int64_t frame = 0;    // dynamics frames done since time 0; time = frame * frameDuration
};

}  // namespace medulla
