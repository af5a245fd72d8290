#pragma once

#include <cstdint>
#include <vector>

#include "physics/dynamics/simd.h"
#include "physics/dynamics/thinning.h"
#include "physics/model/identified_network.h"

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
// Adds what acts on a carried frame to what acts on its sphere.
inline void giveToSphere(const CarriedFrame& c, const FrameLoad& given, Quad& linear, Quad& angular) {
  const Lanes force = load(given.force);
  addTo(linear, force);
  store(angular, load(angular) + load(given.torque) + crossProduct(load(c.worldArm), force));
}

// Measures of four links in the frame half way between their two frames, which lies as the model frame does at rest:
// t (m), and L w (m) with the rotation vector w. Stiffness is that of these, the links' own axes multiplied into it.
struct IdentifiedLinkGroup {
  std::uint32_t frame0[4], frame1[4];
  Lanes3 restLine;                      // m
  Lanes3 along;                         // unit: the axis whose elongation is neo-Hookean
  Lanes inverseRestLength, restLength;  // 1/m, m
  Lanes lengthScale;                    // m
  Lanes stiffness[21];                  // N/m: upper triangle, row after row
  Lanes strain0[6], strain1[6];         // (N/m)^1/2: what the measures add to the strains of the two frames' cells
  Lanes relaxation;                     // s, Rayleigh's beta
  Lanes softening, lengthening;  // 1/rad2, m/rad2: of the measures, by flexion's square phi^2 / (1 + bound phi^2)
  Lanes bound;                   // 1/rad2
};

struct ArcSeries {
  Lanes value, slope;
};

// How the frames of four links stand to each other: identified_measures.h.
struct LinkTurn {
  Rotation middle;
  Lanes3 v;            // vector part of the relative quaternion (c, v), c = cos(theta / 2)
  Lanes f;             // w = 2 f v, f = h / sin h, h = theta / 2
  Lanes stretch;       // w' = f D + stretch v (v.D): D the difference of angular velocities
  Lanes inverseWider;  // 1 / (1 + c)
  Lanes3 w;            // rad
  Lanes3 place;        // m: from frame 0 to frame 1
  Lanes3 arc;          // m: S(w) d
  ArcSeries series;
  Lanes bent;       // w.d
  Lanes3 t;         // m: place - arc
  Lanes along;      // t on the link's axis
  Lanes slope;      // of the neo-Hookean measure of that, less what bending lengthens, by it
  Lanes hyper;      // m: that measure
  Lanes3 flexed;    // rad: w across the link's axis
  Lanes softer;     // of flexed, what is not measured
  Lanes byFlexion;  // slope of phi^2 / (1 + bound phi^2) by phi^2
};

struct LinkMeasures6 {  // m and rad: what the stiffness is of
  Lanes3 t, w;
};

// Four links of cells with strains, from the sum of these to the loads.
struct StrainedLinkState {
  LinkTurn turn;
  LinkMeasures6 damped;
};

// ---- Nodes: those of one sphere, their home, are seen from a frame that stands there and is turned as the frames they
// hang on are in the mean. So are these frames, home first.

struct SkinTerms {  // four of those frames; a host's last are filled up with its home, without a share
  std::uint32_t frame[4];
  Lanes share;                  // in how the host's own frame is turned; 1 in sum over a host's
  Lanes3 restPlace;             // m, from the home's
  Lanes3 axis;                  // unit: along that line; 0 of home
  Lanes length, inverseLength;  // m, 1/m, of it; 0 of home
};

// The frames as they are seen from the host's own; four at a time, so that number i of the one in a lane is 4 i + lane
// doubles from the beginning.
struct SkinTermState {
  Lanes3 way, turn;          // m, how far they are from where they are at rest; twice their quaternion's vector part
  Lanes3 wayRate, turnRate;  // m/s, 1/s
  Lanes3 spare, spareRate;   // m, m/s: the part of the way along the axis beyond what thins the body
  Lanes3 place;              // m, from home
  Lanes cosine;              // of half the angle
  Lanes3 spareRow;           // 1: of the spare part, by the way
};

struct SkinHost {
  int home;  // a frame
  int firstTerms, endTerms;
  int turnShares;  // so many frames, the first, have a share
  Thinning thinning;
};

// What one frame's way and turn do to four nodes' places, and its share of how far their own frames are turned.
// Single precision: a rigid motion asks nothing of these, and they are most of what a substep reads.
struct alignas(16) SkinShare {
  float map[18][4];  // 1 and m: three columns on the way, three on the turn; loaded by 16 bytes, as weights
  float weight[4];
  float along[4];            // 1: of a way along the term's axis, what it does along that axis
  std::int32_t term, state;  // the frame's number among its host's, and its first number's in SkinTermState, in doubles
};

struct alignas(32) SkinGroup {          // four nodes
  float homeTurn[9][4], homeWeight[4];  // as SkinShare, of home, which is always where it is at rest
  int host;
  int firstShare, endShare;  // of the host's other frames
  Lanes3 restOffset;         // m, from home
  Lanes3 lever;              // m: what turns with the nodes' own frames to second order
  Lanes normalExcess;        // N/m5: what the attachment is stiffer along the node's area, over that area's square
};

struct SkinTermLoad {  // of one frame, per node in each lane: on way, turn and spare
  Lanes onWay[3], onTurn[3], onSpare[3];
};

struct IdentifiedBody {              // nothing of others
  int firstFrame = 0, endFrame = 0;  // the spheres' first, in their order
  int firstLinkGroup = 0, endLinkGroup = 0;
  bool hasStrains = false;
  bool turnedOver = false;  // linked frames were more than 90 degrees apart at the beginning of some frame
};

struct Identified {
  std::vector<IdentifiedBody> bodies;  // as the world's
  std::vector<FrameState> frames;
  std::vector<FrameLoad> loads;       // of the current substep
  std::vector<CarriedFrame> carried;  // per frame
  std::vector<IdentifiedLinkGroup> links;
  int linkCount = 0;
  std::vector<StrainedLinkState> strained;   // as links, of the current substep; empty where no body has strains
  std::vector<double> strains;               // per frame, likewise: (N m)^1/2, of its cell
  mutable std::vector<double> stillStrains;  // the same without rates, while an energy is summed up
  std::vector<SkinHost> hosts;
  std::vector<SkinTerms> terms;
  std::vector<SkinTermState> termStates;  // of the current substep
  std::vector<SkinTermLoad> termLoads;    // of one host, while its nodes return theirs
  std::vector<SkinShare> shares;
  std::vector<SkinGroup> skin;
  std::vector<Lanes3> turns;     // per SkinGroup: of its nodes' own frames against the host's; of the current substep
  std::vector<int> ofNodeGroup;  // per group of nodes: in `skin`, -1 of others
};

}  // namespace medulla
