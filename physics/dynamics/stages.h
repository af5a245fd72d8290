#pragma once

#include "physics/dynamics/body_mechanics.h"
#include "physics/dynamics/world_data.h"

// The stages of a substep, in their order, each one loop over arrays. Forces are evaluated at the state at the
// substep's beginning; velocities follow, then loads from tools and contact, then positions (semi-implicit Euler).
namespace medulla {

// s, of a substep or of a stage of an implicit one: when it ends, and from there to the frame's end.
struct StepTime {
  double end = 0, remaining = 0;
};

// link_force.cpp: elongation, flexion, torsion; the frames that nodes hang on
void evaluateLinks(WorldData&, const Batch&);
void evaluateHostLinks(WorldData&, const Batch&);    // of links that nodes hang on, whether these move or not
void evaluateFramedLinks(WorldData&, const Batch&);  // of links whose frames substeps ask for
// Of all, without the frames that no substep asks for; forces of such links are in their slots then.
void evaluateLinkForces(WorldData&, const Batch&);
// carried_weight.cpp: forces and torques of spheres begin with the weight of carried nodes; first of
// evaluateAttachments.
void startSphereForces(WorldData&, const Batch&);
void evaluateAttachments(WorldData&, const Batch&);  // surface.cpp: where every node would be, and the pull on it
void finishNodeForces(WorldData&, const Batch&);     // edge springs and pressure; from the anchors to their hosts
// link_force.cpp: links and what hangs on them, to their two spheres
void returnLinkForces(WorldData&, const Batch&);
void sumSphereForces(WorldData&, const Batch&);  // spheres.cpp
// Before the forces' share of the velocities, which tools and contacts balance in a body at rest.
void dampBodies(WorldData&, const Batch&);      // body_damping.cpp: Rayleigh's alpha
void dragVelocities(WorldData&, const Batch&);  // driven.cpp: the medium's resistance
void stepVelocities(WorldData&, const Batch&);  // spheres and nodes
// dead_loads.cpp: as they are at `time`, the substep's end (s).
void applyDeadLoads(WorldData&, double time);
// How much of such a load acts in the `duration` (s) that ends at `time` (s), 0 to 1: of one that is there at once the
// mean. None while bodies settle.
double shareAt(const WorldData&, const NodeForce& load, double time, double duration);
// driven.cpp: bodies with driven spheres get their velocity at time 0.
void startDrivenBodies(WorldData&);
// driven.cpp: driven spheres get the velocity that takes them within `duration` (s) to their path at `time` (s).
void driveSpheres(WorldData&, double time, double duration);
// loads.cpp, at a frame's start: WorldData::loadForces, from those of the frame before.
void carryLoadForces(WorldData&, const Loads& loads);
// loads.cpp: tool springs and held nodes, implicitly against the velocities of this substep, so that their stiffness
// does not bound the step. Adds N s to `toolImpulse`.
void applyLoads(WorldData&, const Loads& loads, double remaining, std::vector<Eigen::Vector3d>& toolImpulse);
// contact_find.cpp: impulses between bodies, and on bodies from static shapes, against the velocities of this substep.
void resolveContacts(WorldData&);
void stepPositions(WorldData&, const Batch&);

// surface_parts.cpp: which hosts' nodes move by themselves (SurfaceMode::contact).
void layOutSurfaceParts(WorldData&, const std::vector<BodyMechanics>& mechanics);
void moveLoadedParts(WorldData&, const Loads& loads);  // at a frame's start: what tools act on, and what is beside it
void chooseSurfaceParts(WorldData&, const Loads& loads);    // at its end: what has come to rest is carried again
HostRange movingRange(const WorldData&, std::size_t part);  // what of a host's nodes moves by itself now; may be empty

// sleep.cpp
void listAwake(WorldData&);  // WorldData::awake anew
// The memory of a batch's stages: shared with the other batches where it can be, until useWholeStageArrays().
void shareStageArrays(WorldData&, const Batch&);
void useWholeStageArrays(WorldData&, const Batch&);
// At a frame's start: Awake::loadedSkins, and the lists after it.
void frameLoadedSkins(WorldData&, const Loads& loads);
void layOutRest(WorldData&);  // all bodies awake
// At the end of a frame: bodies that have kept still for long enough, with all that they touch, fall asleep. `loads`
// are the frame's: what tools hold stays awake.
void fallAsleep(WorldData&, const Loads& loads);
// With all that rests on them or bears them; their contacts go on with the impulses they had.
void wakeLoaded(WorldData&, const Loads& loads);  // the bodies that tools touch
void wake(WorldData&, int body);                  // if it sleeps
void wakeTouched(WorldData&);                     // those that bodies awake have pressed on in this substep

// All forces of the current state, left in Spheres::force, torque and Nodes::force.
inline void evaluateForces(WorldData& d, const Batch& batch) {
  evaluateLinkForces(d, batch);
  evaluateAttachments(d, batch);
  finishNodeForces(d, batch);
  returnLinkForces(d, batch);
  sumSphereForces(d, batch);
}

// A stage, or several, of all that is awake.
using Stage = void (*)(WorldData&, const Batch&);
inline void runStage(WorldData& d, Stage stage) {
  for (const Batch& batch : d.awake.batches) stage(d, batch);
}

// dead_loads.cpp: the bodies' into WorldData::deadLoads. Throws std::runtime_error naming the body where one is on no
// node, not finite, or ends before it begins.
void layOutDeadLoads(WorldData&);

// carried_nodes.cpp: nodes of a skin, and others that do not move by themselves, to where they hang from their hosts;
// needs evaluateHostLinks at the current state. Where gravity is felt, their weight from now on acts there.
void placeCarriedNodes(WorldData&);
void weighCarriedNodes(WorldData&);  // carried_weight.cpp, as part of it
// carried_weight.cpp: what carried nodes weigh is less what their body falls by on the whole, or one that falls freely
// would begin to turn: at a substep's end, its acceleration since rememberFalling() or the last such end.
void layOutCarriedWeight(WorldData&);
void rememberFalling(WorldData&);
void feelGravity(WorldData&, const Batch&);
// At a frame's end: under what was felt in its mean carried nodes hang from now on. What strikes a body throws them no
// farther than they weigh at rest.
void hangByFelt(WorldData&);

// Angular velocity from orientation and angular momentum.
void refreshAngularVelocities(WorldData&);

// J: elastic energies of the current state; where `ofBodies` is given, each body's is added there.
double linkEnergy(const WorldData&, std::vector<double>* ofBodies = nullptr);
// Edges, attachments and pressure; of the last evaluateAttachments().
double surfaceEnergy(const WorldData&, std::vector<double>* ofBodies = nullptr);
inline double elasticEnergy(const WorldData& d) {
  return linkEnergy(d) + surfaceEnergy(d);
}

}  // namespace medulla
