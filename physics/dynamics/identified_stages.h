#pragma once

#include "physics/dynamics/point_spring.h"
#include "physics/dynamics/skin_map.h"
#include "physics/dynamics/world_data.h"

// The stages of a substep on bodies with LinkModel::identified; each is called by its counterpart in stages.h.
namespace medulla {

// identified_link.cpp
void evaluateIdentifiedLinks(WorldData&, const Batch&);  // frames from spheres; links' forces on frames
void returnFrameForces(WorldData&, const Batch&);        // from frames to spheres, added
double identifiedLinkEnergy(const WorldData&, std::vector<double>* ofBodies);  // as linkEnergy()
double identifiedLinkEnergy(const Identified&, const IdentifiedBody&);

// identified_turns.cpp
// Frames that links tell a whole turn apart are so no longer, of the state that frames were last placed at: where that
// leaves less energy in the links, or whatever it leaves.
void dropCostlyTurns(WorldData&);
void dropWholeTurns(WorldData&, int body);

// identified_surface.cpp: the nodes of a range that hangs on frames.
void pullOnFrames(WorldData&, const HostRange&);
void returnToFrames(WorldData&, const HostRange&, Lanes pressure);
void placeOnFrames(WorldData&, const HostRange&);      // carried nodes, which may move by themselves in the next frame
void placeSkinOnFrames(WorldData&, const HostRange&);  // nodes without mass: where they are is all that is asked
double normalEnergy(const WorldData&, int node);       // J, of what the attachment is stiffer along the normal

// What acts at the places of a range's nodes (N, N m, world) goes to their frames; at the state of the last
// pullOnFrames().
class FrameReturn {
 public:
  FrameReturn(WorldData&, const HostRange&);
  void add(int group, const Lanes3& force, const Lanes3& moment);  // the moment to what carries the nodes' surface
  void finish();

 private:
  WorldData* d_;
  const SkinHost* host_;
  HostFrame own_;
  Lanes3 force_, moment_;  // seen in it
};

// identified_node.cpp
Eigen::Vector3d positionOnFrames(const WorldData&, int node);
HostPoint hostPointOnFrames(const WorldData&, int node);

}  // namespace medulla
