#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "physics/dynamics/broad_phase.h"
#include "physics/dynamics/contact.h"
#include "physics/dynamics/simd.h"
#include "physics/model/surface_queries.h"

// The arrays of contact. A collider is a round cone between the balls of two spheres, or a ball: a cone whose two ends
// are the same. Lists of near pairs outlive many substeps (Verlet lists): they hold every pair nearer than a margin and
// are made anew once a ball has moved half of what the margin is beyond a substep's reach.
namespace medulla {

struct Collider {
  std::uint32_t sphere0, sphere1;  // equal: a ball
  int body;
};

struct PairGroup {  // four near pairs; the last group is filled up with pairs that are infinitely far apart
  std::uint32_t collider0[4], collider1[4];
  Lanes gapAtList;  // m
};

// Of a triangle: its edges (k: from corner k to the next) that no other triangle has, and the corners on any such.
struct OpenRim {
  std::array<bool, 3> edge, corner;
};

struct StaticContactShape {
  StaticShape::Kind kind;
  Eigen::Isometry3d worldFromShape;
  Eigen::Vector3d halfSize;  // m, box
  double radius = 0;         // m, sphere
  double rootFriction = 0;   // the friction of a pair is the product of the two sides' roots
  SurfaceTree tree;          // mesh, world frame
  std::vector<OpenRim> rim;  // mesh, per triangle of `tree`
};

struct StaticNeighbour {
  std::uint32_t shape, sphere;
  double gapAtList;                // m
  int firstTriangle, endTriangle;  // mesh: in ContactData::nearTriangles, the nearest first
};

// One point of contact: up to four spheres' velocities with weights that add up to its relative velocity, and the
// impulse that goes back to them with the same weights. Fewer than two sides where the other is static.
// Four lines of the cache: contacts of a heap outgrow it, and all are read in every pass.
struct alignas(64) Contact {
  std::uint64_t key;  // which pair: what ties it to the substep before
  std::int16_t ends = 0, firstSideEnds = 0;
  bool misses = false;  // as it moves now
  std::array<std::uint32_t, 4> sphere;
  std::array<double, 4> weight;        // < 0 on the side that the normal points away from
  std::array<double, 2> reach;         // m, per side: from the ball's centre to the point of contact, along the normal
  double gap = 0;                      // m
  double smallerRadius = 0;            // m, of the two in contact
  Lanes normal, tangent0;              // unit, into the second side, and across; w = 0
  double inverseNormal = 0;            // kg: of the mobility along the normal, 1/kg, and the softness together
  double tangentMobility[2] = {0, 0};  // 1/kg: velocity across per impulse along the normal
  double inverseTangent[3] = {0, 0, 0};  // kg: inverse of the mobility in the tangent plane: 00, 11, 01
  double softness = 0;                   // 1/kg, gamma
  double bias = 0;                       // m/s
  double friction = 0;
  double normalImpulse = 0, tangentImpulse0 = 0, tangentImpulse1 = 0;  // N s
};
static_assert(sizeof(Contact) == 256);

// m, from the frame of the contact's end `e` to the point of contact, moved along with its side. Not kept: too large.
// `arm` is ContactData::arm of the end's sphere.
MEDULLA_INLINE Lanes leverOf(const Quad& arm, const Contact& c, int e) {
  return fma(splat(c.reach[e >= c.firstSideEnds]), c.normal, load(arm));
}

struct CarriedImpulse {
  std::uint64_t key;
  Quad impulse;  // N s, world
};

// What friction held with at the end of an implicit step. Sticking is a spring taken implicitly (implicit_loads.cpp).
struct HeldFriction {
  std::uint64_t key;
  Quad force;     // N, world
  double energy;  // J, that it has taken in and not given back
};

// What contacts ask of a sphere and change in it, in the world's frame: in one place, three lines of the cache, because
// every pass asks for it once per contact of the sphere.
struct alignas(64) ContactSphere {
  Quad velocity;           // m/s; w: 1/kg, inverse mass
  Quad angularVelocity;    // rad/s
  Quad arm;                // ContactData::arm
  Quad inverseInertia[3];  // columns, 1/(kg m2); zero where rotation is fixed
};

// Of a sphere, in a substep.
struct MomentumChange {
  Quad velocity, angularMomentum;  // m/s, kg m2/s
};

struct ContactData {
  ContactMode mode = ContactMode::none;
  // Constants.
  std::vector<Quad> restBall;           // m, per sphere: the ball's centre in its sphere's frame, and its radius
  std::vector<double> inverseCellMass;  // 1/kg, per sphere: with what its share of the surface weighs; 0: fixed
  std::vector<double> inverseYoung;     // 1/Pa, per sphere: of its tissue
  std::vector<Collider> colliders;
  std::vector<std::vector<std::uint32_t>> excluded;  // per collider: later ones of its body that it never meets
  std::vector<char> collides;                        // bodies x bodies
  std::vector<double> rootFriction;                  // per body
  std::vector<StaticContactShape> statics;
  // m, statics x spheres: where the shape is nearest to the ball at the start, if the body is held there; else NaN
  std::vector<Eigen::Vector3d> fixedAt;
  double freeMove = 0;  // m: what a ball may move before the lists are made anew

  // Lists, and the balls' places when they were made. Pairs are chosen from those of overlapping boxes, which are wide
  // enough to serve several lists.
  std::vector<Quad> ballAtList, ballAtBoxes;
  std::vector<double> boxMove;  // m, per sphere: what its ball may move before boxes are made anew
  std::vector<PairGroup> pairs;
  std::vector<StaticNeighbour> staticNeighbours;
  std::vector<TriangleDistance> nearTriangles;  // at the time of the list
  BroadPhase broadPhase;
  std::vector<AxisBox> boxes;

  // Of the current substep.
  std::vector<Quad> ball;      // m, per sphere: centre in the world, and radius
  std::vector<Quad> arm;       // m, per sphere: from its frame to the ball's centre; w = 0
  std::vector<AxisBox> swept;  // per body: outrunsContact()
  std::vector<Contact> contacts;
  std::vector<ContactSphere> spheres;
  std::vector<double> blow;                // m/s, per body: the fastest that strikes it
  std::vector<char> groupIsAsked;          // per four of them: set in this substep
  std::vector<signed char> changedInPass;  // per sphere: the solver's last pass that changed it by more than a little

  // State: the impulses that the last substep ended with, ascending in key; the next one starts from them.
  std::vector<CarriedImpulse> carried;
  std::vector<CarriedImpulse> resting;  // those of contacts of bodies that sleep, likewise
  // Per sphere, of the last substep with loads: what contacts made of its momenta; the loads of the next count on it.
  std::vector<MomentumChange> change;
  std::vector<HeldFriction> held;  // of implicit steps: of every contact that pushed in the last one, likewise
  double reach = 0;         // m: two things nearer than this are looked at, as they might touch within the substep
  double margin = 0;        // m: pairs nearer than this are listed
  bool listsAreOld = true;  // whatever the balls have moved: bodies fell asleep or woke, or none yet

  PenetrationReport penetration;
  std::vector<BodyOverlap> startOverlaps;
};

}  // namespace medulla
