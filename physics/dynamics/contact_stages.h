#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "physics/dynamics/contact_geometry.h"
#include "physics/dynamics/world_data.h"

// The parts of contact, in the order in which a substep runs them; stages.h calls them through resolveContacts().
namespace medulla {

// contact_layout.cpp: colliders, exclusions and static shapes from d.bodies, d.settings.contact and `statics`, and who
// overlaps at the start. Throws std::runtime_error where a shape or a neighbour is out of range.
void layOutContact(WorldData& d, const std::vector<StaticShape>& statics);

// contact_lists.cpp
void placeBalls(WorldData& d);            // ContactData::ball at the current state
void listNeighbours(WorldData& d);        // both lists anew, at ContactData::ball
void listStaticNeighbours(WorldData& d);  // contact_static.cpp: the part of it that concerns static shapes
double farthestMove(const ContactData& c, const std::vector<Quad>& from);  // m, of any ball since it was there

Eigen::Vector3d nearestPoint(const StaticContactShape& shape, const Eigen::Vector3d& p);  // contact_static.cpp; m

// Appends a contact for every pair that overlaps or might before the substep's end; ascending in key. `moved` is
// what the farthest ball has moved since ContactData::ballAtList, or more.
void findPairContacts(WorldData& d, double moved);    // contact_find.cpp
void findStaticContacts(WorldData& d, double moved);  // contact_static.cpp

// The body of a contact's first side; of its second side, -1 where that is a static shape.
std::array<int, 2> bodiesOf(const WorldData& d, std::uint64_t key);

void findContacts(WorldData& d);  // contact_find.cpp: ContactData::contacts at the present state

// A contact's damped elastic spring, taken implicitly: v + bias + softness * impulse = 0 along the normal at the end of
// a step of this duration (s), where the impulse is not negative. m/s, 1/kg.
struct ContactLaw {
  double bias, softness;
};
ContactLaw contactLaw(const WorldData& d, const Contact& c, double duration);
double contactBias(const Contact& c, double duration);  // ContactLaw::bias
void notePenetration(ContactData& c);                   // of ContactData::contacts

void solveContacts(WorldData& d);  // contact_solve.cpp: impulses on spheres

// Gaps of a group's four pairs, at ContactData::ball; s and t are 0 on balls.
ConeContact closestOfPairs(const ContactData& c, const PairGroup& g);

// m: what closes within one whole substep at this speed (m/s) is looked at, in any case.
constexpr double kFastest = 2;
inline double leastReach(const WorldData& d) {
  return kFastest * (d.settings.frameDuration / d.substeps);
}

// m/s, of a ball's centre.
Eigen::Vector3d ballVelocity(const WorldData& d, std::uint32_t sphere);

// contact_find.cpp: whether a ball moves so far in `time` (s) at the present velocities that it might pass what it
// touches before anything is looked for again.
bool outrunsContact(WorldData& d, double time);

// contact_static.cpp: whether the shape is within `distance` (m) of `p`, or `p` behind what is no mesh.
bool isNear(const StaticContactShape& shape, const Eigen::Vector3d& p, double distance);

}  // namespace medulla
