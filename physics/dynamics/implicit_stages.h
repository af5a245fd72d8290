#pragma once

#include "physics/dynamics/implicit_data.h"
#include "physics/dynamics/stages.h"

// The stages of an implicit step, in their order. All work on the state as it stands in WorldData.
namespace medulla {

struct LinkBlocks;  // link_blocks.h

// implicit_layout.cpp: what never changes; `duration` is that of a stage (s).
void layOutImplicit(const WorldData& d, double duration, ImplicitData& s);

// surface_map.cpp: the velocities with which spheres of this motion carry the anchors of all dynamic nodes, into
// `carried`; overwrites the velocities in Links::frames and the rates of identified frames.
void carryMotion(WorldData& d, const Motion& motion, std::vector<Quad>& carried);
// Its transpose: impulses on the anchors, added to the spheres' part of `motion`; overwrites Links::loads and
// Identified::loads.
void returnImpulses(WorldData& d, const std::vector<Quad>& impulses, Motion& motion);
// The links' part of it, of what acts on their anchors; at the frames of the last evaluateLinks().
void returnLinkLoads(const WorldData& d, const std::vector<LinkLoads>& loads, Motion& motion);
// Adds J^T m J of the nodes' maps J, `mass` per node (kg), to the spheres' blocks; but for nodes on frames.
void addCarriedMass(const WorldData& d, const std::vector<double>& mass, std::vector<Block6>& diagonal,
                    std::vector<Block6>& beside);

// implicit_loads.cpp: contacts, tools and dead loads at the present motion.
struct StageLoads {
  const Loads* loads = nullptr;
  StepTime time;       // of the stage
  double lasting = 0;  // s, of the step that its forces stand for: after what the stage before it stands for
};
void evaluateLoads(WorldData& d, ImplicitData& s, const StageLoads& loads);  // rows, and their part of the residual
void recallFriction(const WorldData& d, ImplicitData& s);  // of ContactData::contacts: ImplicitData::held
void keepFriction(WorldData& d, const ImplicitData& s);    // for the step after this one; of bodies that did not fail
bool contactPushes(const ImplicitData& s);
void sumWorkOfLoads(ImplicitData& s);      // ImplicitData::workOfLoads; a contact's is its first body's
inline bool isEmpty(const LoadRow& row) {  // of a held node of a skin
  return row.first == row.end;
}
// Adds what an impulse (N s) along the row gives to each of its quads.
inline void addAlong(const ImplicitData& s, const LoadRow& row, double impulse, Motion& to) {
  for (int k = row.first; k < row.end; ++k) {
    Quad& at = to[s.rowQuad[k]];
    store(at, fma(splat(impulse), load(s.rowCoefficient[k]), load(at)));
  }
}

inline int bodyOf(const ImplicitData& s, const LoadRow& row) {  // the first, where two touch
  return s.bodyOf[s.rowQuad[row.first]];
}

// link_stiffness.cpp: adds the links' stiffness and damping, times the squared duration, to `diagonal`; sets `beside`.
// `definite`: only what is positive semidefinite of it.
void addLinkStiffness(const WorldData& d, ImplicitData& s, bool definite);
// Of four links, whose places in ImplicitData::pairs are `pair`; -1: none.
void addLinkBlocks(const LinkBlocks& m, const int (&pair)[4], ImplicitData& s);

// identified_implicit.cpp: the same of links and nodes between frames.
void addIdentifiedStiffness(const WorldData& d, ImplicitData& s);
void listIdentifiedPairs(const WorldData& d, std::vector<std::array<int, 2>>& pairs);
void layOutStars(const WorldData& d, ImplicitData& s);  // after all links' pairs
void setIdentifiedFrameRates(WorldData& d, const Motion& motion);
void carryOnFrames(WorldData& d, const HostRange& range, std::vector<Quad>& carried);
void returnImpulsesToFrames(WorldData& d, const HostRange& range, const std::vector<Quad>& impulses);
// Adds to the impulses `given` of what stands in `carried` what attachments are stiffer along the normals.
void stiffenNormals(const WorldData& d, ImplicitData& s, const HostRange& range);
void returnFrameImpulses(const WorldData& d, Motion& motion);

// identified_mass.cpp: J^T m J of nodes on frames, into `lumped` and `lumpedBeside`; once masses are laid out.
void layOutMassOnFrames(const WorldData& d, ImplicitData& s);
void addMassOnFrames(const WorldData& d, ImplicitData& s);

// implicit_system.cpp
// `definite`: the matrix is positive definite in any state. Else it is nearer to the derivative; false where it is not
// definite and cannot be used.
bool assembleSystem(WorldData& d, ImplicitData& s, bool definite);
void applySystem(WorldData& d, ImplicitData& s, const Motion& x, Motion& y);  // y = A x
// Conjugate gradients: A change = -residual, to `tolerance` of the residual. Returns the iterations.
using Operator = void (*)(WorldData& d, ImplicitData& s, const Motion& x, Motion& y);
int solveSystem(WorldData& d, ImplicitData& s, double tolerance, Operator apply);
// P change = -residual, with the preconditioner's matrix P. `goesOn`: the last step along ImplicitData::direction
// changed the residual by ImplicitData::image; what that tells of the derivative is made use of, as conjugate gradients
// would.
void solvePreconditioner(WorldData& d, ImplicitData& s, bool goesOn);
void applyRows(const ImplicitData& s, const Motion& x, Motion& y);  // y += the loads' part of A x
double product(const Motion& a, const Motion& b);
void addScaled(double f, const Motion& b, Motion& a);  // a += f b
void hold(const std::vector<Quad>& freedom, Motion& m);

// Calls visit(mass, position, quad of its motion) for all of a body that has a motion of its own.
template <class Visit>
void visitMasses(const WorldData& d, const BodyRange& range, const Visit& visit) {
  for (const int i : spheresOf(range))
    visit(d.spheres.groups[i / 4].mass[i % 4], vectorOf(d.spheres.position[i]), 2 * i);
  for (const int i : range.node)
    if (i < d.nodes.dynamicEnd) visit(d.nodes.mass[i], vectorAt(d.nodes.position, i), 2 * d.spheres.count + i);
}

// implicit_stage.cpp: backward Euler in one stage, by Newton's iteration.
// From the present state, which `s.start` holds, with its momenta there. False where the iteration does not settle.
bool solveStage(WorldData& d, ImplicitData& s, const StageLoads& stage);
void place(WorldData& d, const ImplicitData& s, double time);  // where `s.motion` leads to in `time` from the start
double restEnergy(const ImplicitData& s, double mass);  // J, below which motion is what the iteration leaves open
// Of the four spheres of a group as they stand.
Lanes3 angularMomenta(const WorldData& d, const ImplicitData& s, std::size_t group);
// `visit(sphere, momentum)` of every sphere.
template <class Visit>
void visitAngularMomenta(const WorldData& d, const ImplicitData& s, const Visit& visit) {
  for (int i = 0; i < d.spheres.count; i += 4) {
    const Lanes3 momenta = angularMomenta(d, s, i / 4);
    Lanes l[4] = {momenta.x, momenta.y, momenta.z, splat(0)};
    transpose(l[0], l[1], l[2], l[3]);
    for (int k = 0; k < std::min(4, d.spheres.count - i); ++k) visit(i + k, l[k]);
  }
}

// implicit_energy.cpp: what a step made of energy, judged for each island of bodies that push each other by itself.
void noteEnergyBefore(WorldData& d, ImplicitData& s);       // of the state that the step sets out from
double kineticEnergy(const WorldData& d, ImplicitData& s);  // J
// At the step's end: ImplicitData::verdicts. False where any failed, and nothing is done then. Else islands that gained
// a little are slowed down, and those at rest stay as they were.
bool keepEnergy(WorldData& d, ImplicitData& s, bool twoStages);
// The same where some failed that cannot be tried again: these go on without speed.
void creep(WorldData& d, ImplicitData& s);
inline bool hasFailed(const ImplicitData& s, int body) {
  return s.verdicts[body] == Verdict::fails;
}
// Puts back the state that `start` holds.
void restore(WorldData& d, const StageStart& start);

// implicit_step.cpp: one substep; positions, velocities, momenta and the tools' impulses.
void stepImplicitly(WorldData& d, const Loads& loads, const StepTime& time, std::vector<Eigen::Vector3d>& toolImpulse);

}  // namespace medulla
