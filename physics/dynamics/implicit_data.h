#pragma once

#include <array>
#include <vector>

#include "physics/dynamics/block_cholesky.h"
#include "physics/dynamics/whole_motion.h"
#include "physics/dynamics/world_data.h"
#include "physics/model/disjoint_sets.h"

// What an implicit step works on, laid out once. A motion has one velocity for every freedom: two quads per sphere,
// linear and angular, then one per dynamic node. Everything is in impulses: matrices in kg, right sides in N s.
namespace medulla {

using Motion = std::vector<Quad>;

// The state from which a stage sets out.
struct StageStart {
  std::vector<Quad> position, orientation, angularMomentum, unwoundTwist;
  std::vector<Lanes3> nodePosition;  // as in Nodes
  Motion motion;  // angular velocities are the first guess only: angularMomentum is what forces add to
};

struct InertiaGroup {  // kg m2, sphere frames: xx, yy, zz, xy, xz, yz; 0 on pads
  Lanes entry[6];
};

// One direction of a load at a point: its velocity is the sum of coefficient . motion[quad], and impulses return by the
// same coefficients. `weight` (kg) is impulse per velocity.
struct LoadRow {
  int first = 0, end = 0;  // in ImplicitData::rowQuad, rowCoefficient
  double weight = 0;
  double impulse = 0;  // N s at the present motion
};

struct MovedBall {
  Quad arm;       // m, from its sphere's frame to its centre
  Quad velocity;  // m/s, of the centre
};

// A contact that pushes or a tool's spring: three rows, along the normal and two tangents.
struct PointLoad {
  bool isContact = false;
  std::size_t index = 0;  // in ContactData::contacts, or of Loads, tool springs first
  std::array<Eigen::Vector3d, 3> axes;
};

// What sliding asks of a contact's or a tool's friction: implicit_loads.cpp.
struct Drag {
  std::size_t place = 0;     // a contact's index, or a load's behind all contacts; ascending
  Eigen::Vector3d wanted;    // N s: what would stop it
  Eigen::Vector3d foretold;  // N s: what the linear system made of that, up to the limit
  double most = 0;           // N s: Coulomb's limit; 0 where nothing pushes
};

// What a contact's friction goes on from.
struct Holding {
  Eigen::Vector3d impulse;  // N s, across the normal
  double energy;            // J: HeldFriction::energy
};

// The spheres by whose motions the strain of one identified cell changes: its own and its neighbours'.
struct StrainStar {
  int first = 0, end = 0;  // in ImplicitData::starSphere, starRate
  int firstPair = 0;       // in starPair: of each with each after it
  double relaxation = 0;   // s
};

// Of the nodes of one skin host: what two of its frames feel of their masses, one as it moves and the other.
struct CarriedBlock {
  int term0, term1;      // of the host's terms, not in falling order; -1: home
  int sphere0, sphere1;  // that carry these frames; -1: held
  int pair;              // in ImplicitData::pairs where they are two; -1 - k: the other way round
  Block6 mass;           // kg, kg m, kg m2: seen in the host's frame, of home's motion and of the others' against it
};
struct CarriedHost {
  int host;        // in Identified::hosts
  int first, end;  // in ImplicitData::carriedBlocks
};

// N s, N m s, about the origin.
struct LostMomenta {
  Eigen::Vector3d linear, angular;
};

// What the energy of a body that joined no other by contact says of a step, or of all that joined.
enum class Verdict { passes, slows, rests, fails };

// J: of a body, or of an island of bodies that push each other, in the balance of its first.
struct EnergyBalance {
  double kineticBefore = 0, elasticBefore = 0, kinetic = 0, elastic = 0;
  double given = 0;                       // by gravity, loads, contacts and paths
  double chords = 0;                      // of velocities across the tangents, because bodies turn
  double mass = 0;                        // kg
  double most = 0, due = 0, mostDue = 0;  // EnergyLedger's, before
};

struct ImplicitData {
  double duration = 0;  // s, of a stage
  // Constants.
  std::vector<Quad> freedom;              // as Motion: 1, or 0 where a freedom is held or led
  std::vector<InertiaGroup> inertia;      // four spheres each
  std::vector<double> pull, carriedMass;  // kg, per node: the attachments' share; what a host feels of node and springs
  std::vector<double> nodeMobility;       // 1/kg, per node: of itself, its attachment and its edges; 0: held
  // Of attachments that are stiffer along their normals, over the square of the node's area: what a node moves less
  // along it (1/(kg m4)), what a host feels more (kg/m4). Empty where there are none.
  std::vector<double> normalMobility, carriedNormal;
  std::vector<std::array<int, 2>> pairs;  // spheres of each link, identified ones last; -1: held
  int linkPairs = 0;                      // so many; then those that share a star alone,
  int stiffPairs = 0;                     // so many; then those that share nodes alone
  std::vector<StrainStar> stars;
  std::vector<int> starSphere;
  std::vector<std::array<int, 4>> starPlace;  // per identified link: in starRate, of both ends in star 0 and in star 1
  std::vector<int> starPair;                  // in `pairs`; -1 - k: the other way round
  std::vector<CarriedHost> carriedHosts;
  std::vector<CarriedBlock> carriedBlocks;
  // Of the present iteration.
  std::vector<Block6> diagonal, beside;      // spheres and links alone, per sphere and per stiff pair
  std::vector<Block6> lumped, lumpedBeside;  // and with the surface's share in them; per pair
  std::vector<Block6> homeColumn;            // while one host's share is added
  BlockCholesky spheres;                     // of the latter and of loads
  std::vector<Vector6> starRate;             // (N/m)^1/2, as starSphere
  std::vector<LoadRow> rows;
  std::vector<int> rowQuad;
  std::vector<Quad> rowCoefficient;
  std::vector<PointLoad> loads;
  std::vector<MovedBall> balls;          // per sphere, where there are contacts
  std::vector<Drag> drags, dragsBefore;  // of what pushes at the present motion, and where the last system was made
  bool isFirstSystem = true;             // none was made in this stage
  std::vector<Holding> held;             // per contact

  StageStart before, start;      // of the step, of its present stage
  std::vector<double> bodyMass;  // kg, per body
  double totalMass = 0;          // kg
  std::vector<int> bodyOf;       // as Motion
  // J, per body: twice the energy of the motion that its residual would give its free masses, and what is little
  // enough.
  std::vector<double> left, enough;
  std::vector<double> reach;    // J, per body: what a stage's speeds can come from, its weight and its loads apart
  std::vector<double> turning;  // J^1/2, per body: root of twice its energy of turning, times the angle; 0: slow
  std::vector<double> workOfPaths, workOfLoads;  // J, per body, in this stage
  std::vector<EnergyBalance> bodies, islands;    // per body
  DisjointSets joined;                           // bodies that touch
  std::vector<int> island;                       // per body: the first one of its island
  std::vector<char> isPushed;                    // per body: by anything at all
  std::vector<Verdict> verdicts;                 // per body: of its island
  std::vector<double> sums;                      // J, per body, while energies are summed up
  std::vector<WholeMotion> whole;                // per body, at the stage's start or end
  std::vector<LostMomenta> lost;                 // per body, in this step
  Motion balance, kept;  // the residual without loads; the motion while a derivative is taken or a search goes on
  Motion motion, residual, remaining, change, direction, image, preconditioned;
  std::vector<Eigen::Vector3d> toolImpulses;  // N s, per load, of the whole step
  std::vector<Quad> carried, given;           // per node: the operator's velocities of anchors, impulses
  std::vector<Vector6> blocks;
  long solves = 0, iterations = 0;  // linear systems, and conjugate gradients in all; for benchmarks
};

}  // namespace medulla
