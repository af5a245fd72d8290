#pragma once

#include <cstdint>
#include <vector>

#include "physics/dynamics/simd.h"

// Arrays of what was identified offline (physics/model/identified_network.h), in this world's units and for AVX2: links
// and nodes four at a time, both between frames.
namespace medulla {

// What links and nodes hang on: where a sphere carries the centroid of its cell, or a point of a held patch.
struct FrameState {
  Quad position, velocity;            // m, m/s, world
  Quad orientation, angularVelocity;  // worldFromModel of the frame at rest, as x, y, z, w; rad/s
};
struct FrameLoad {
  Quad force, torque;  // N, N m
};
struct CarriedFrame {
  int sphere;     // -1: held
  Quad restArm;   // m, from the sphere's frame, in it
  Quad worldArm;  // m, of the current substep
};

// Measures of four links in the frame half way between their two frames, which lies as the model frame does at rest:
// t (m), and L w (m) with the rotation vector w. Stiffness is that of these, the links' own axes multiplied into it.
struct IdentifiedLinkGroup {
  std::uint32_t frame0[4], frame1[4];
  Lanes3 restLine;                      // m
  Lanes3 along;                         // unit: the axis whose elongation is neo-Hookean
  Lanes inverseRestLength, restLength;  // 1/m, m
  Lanes lengthScale;                    // m
  Lanes stiffness[21];                  // N/m: upper triangle, row after row
  Lanes relaxation;                     // s, Rayleigh's beta
};

// One of the frames that four nodes hang on. A node that hangs on fewer has some with weight and map 0.
struct SkinTerm {
  std::uint32_t frame[4];
  Lanes weight;
  Lanes3 restPlace;  // m, of the frame from the mean of all the node's
  // Rows on the frame's way and on the vector part of its turn (half of a small rotation), m: six numbers for x, y, z
  // each. Single precision: a rigid motion asks nothing of them, and they are most of what a substep reads.
  alignas(16) float map[18][4];
};

// A frame as it stands against the blended one, in that: left by the pass that places nodes for the one that returns
// loads.
struct SkinTermState {
  Lanes3 place, turn;  // m from the mean; vector part of the quaternion, of which `cosine` is the rest
  Lanes cosine;
};

struct SkinGroup {
  int firstTerm, endTerm;
  Lanes3 restOffset;   // m, from the mean of the frames
  Lanes normalExcess;  // N/m5: what the attachment is stiffer along the node's area, over that area's square
};

// Where four nodes' frames blend to.
struct SkinGroupState {
  Rotation rotation;
  Lanes3 offset;      // m, from the mean of the frames to the nodes' places, in the blended frame
  Lanes inverseNorm;  // of the weighted sum of quaternions
};

struct IdentifiedBody {
  int body;
  int firstFrame, endFrame;  // the spheres' first, in their order
  int firstLinkGroup, endLinkGroup;
};

struct Identified {
  std::vector<IdentifiedBody> bodies;
  std::vector<FrameState> frames;
  std::vector<FrameLoad> loads;       // of the current substep
  std::vector<CarriedFrame> carried;  // per frame
  std::vector<IdentifiedLinkGroup> links;
  int linkCount = 0;
  std::vector<SkinTerm> terms;
  std::vector<SkinTermState> termStates;
  std::vector<SkinGroup> skin;
  std::vector<SkinGroupState> skinStates;
  std::vector<int> ofNodeGroup;  // per group of nodes: in `skin`, -1 of others
};

}  // namespace medulla
