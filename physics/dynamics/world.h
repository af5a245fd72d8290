#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "physics/dynamics/contact.h"
#include "physics/dynamics/frame.h"
#include "physics/dynamics/loads.h"
#include "physics/dynamics/region.h"
#include "physics/model/soft_body_model.h"

namespace medulla {

// What a body is made of. Stiffnesses of links and springs follow from it and from the mesh's own sections.
struct Tissue {
  double young = 5e3;     // Pa, > 0; more is stiffer and needs smaller substeps
  double poisson = 0.45;  // 0 <= nu < 0.5
  double density = 1040;  // kg/m3, > 0
  double damping = 0.1;   // ratio to critical of the lowest mode that deforms the body, >= 0; 0 swings for ever
  double friction = 0.2;  // Coulomb's, >= 0, sticking and sliding; a pair has the geometric mean of its two sides
  bool operator==(const Tissue&) const = default;
};

// Dimensionless steering of the three ways a link deforms (paper 2.2); 1 keeps the material's value.
struct LinkFactors {
  double elongation = 1, flexion = 1, torsion = 1;  // > 0
  bool operator==(const LinkFactors&) const = default;
};
struct SteeredLinks {
  LinkFactors factors;
  std::optional<Region> where{};  // the links whose middles lie there, at rest; absent: all
  bool operator==(const SteeredLinks&) const = default;
};

// How a link answers. springs: six independent damped springs (paper 2.2). beam: the flexion angles of its two ends are
// coupled as in a beam, elongation is neo-Hookean, and what hangs on it grows thinner with its stretch. identified: the
// model's own links, skin and patches, from finite elements (SoftBodyModel::identified); what it holds is what
// `fixedNodes` must name.
enum class LinkModel { springs, beam, identified };

enum class SurfaceMode {
  full,     // every node is a mass of its own (paper 2.3)
  skin,     // nodes follow the skeleton without mass: tools then load the skeleton through the attachments
  contact,  // full where tools and loads act and where it still moves against the skeleton, skin elsewhere; under the
            // implicit integrator full
};

enum class FixedFreedom { translation, all };
struct FixedSphere {
  int sphere = 0;
  FixedFreedom freedom = FixedFreedom::all;
  bool operator==(const FixedSphere&) const = default;
};

// A sphere led along a path, whatever pulls at it: rest + velocity t + ramp(t) amplitude sin(2 pi frequency t + phase)
// along the axis, where the ramp rises smoothly from 0 to 1 over the first period. It turns freely, or, where `freedom`
// is all, keeps its orientation: otherwise a body that is led by a single sphere and beats hard rolls about its
// direction of travel, because nothing holds it upright. The whole body starts at `velocity`. Paper 6: the dolphin's
// head.
struct DrivenSphere {
  int sphere = 0;
  FixedFreedom freedom = FixedFreedom::translation;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();     // world; any length but 0
  double amplitude = 0;                                // m, >= 0
  double frequency = 1;                                // Hz, > 0
  double phase = 0;                                    // rad
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, world
};

struct BodyDescription {
  std::string name;
  std::shared_ptr<const SoftBodyModel> model;
  Tissue tissue;
  std::vector<SteeredLinks> steered;  // factors of several on one link multiply
  SurfaceMode surface = SurfaceMode::full;
  LinkModel links = LinkModel::beam;
  Eigen::Isometry3d worldFromModel = Eigen::Isometry3d::Identity();
  std::vector<FixedSphere> fixed;
  // Held in place; not on a skin, which follows its spheres. They clamp the sections of links beside held spheres.
  std::vector<int> fixedNodes;
  std::vector<DrivenSphere> driven;
  std::optional<std::vector<int>> neighbours;  // bodies that it may touch; absent: all that do not choose others
  std::vector<DeadLoad> deadLoads;             // several on one node add up
};

// explicitEuler: semi-implicit Euler in substeps below the stability limit. implicit: backward Euler (order 1) or
// SDIRK2 (order 2), stable at any substep.
enum class Integrator { explicitEuler, implicit };

struct WorldSettings {
  Eigen::Vector3d gravity{0, -9.81, 0};  // m/s2
  double ambientDrag = 0;                // 1/s, >= 0: everything loses this share of its speed; 0 but under water
  double frameDuration = 0.02;           // s, one dynamics frame
  Integrator integrator = Integrator::explicitEuler;
  int order = 1;  // of the implicit integrator, 1 or 2
  // Per dynamics frame; 0: as many as the stability estimate asks for, explicit of 10 ms at most, implicit of 5; 16 or
  // more per swing of what drives a sphere.
  int substeps = 0;
  ContactMode contact = ContactMode::none;
  // Dynamics frames before time 0, in which bodies come to rest under weight and contact: dead loads wait, driven
  // spheres stay where they are, and the lowest mode of each body is damped critically.
  int settleFrames = 0;
  // s, >= 0: a body that has kept still for this long, within 1 % of its spheres' mean radius, sleeps, with all that it
  // touches; it wakes when a tool or a body awake touches it. 0: none ever sleeps, so that what creeps goes on to
  // creep. Without effect on the implicit integrator.
  double sleepAfter = 0;
};

struct Energies {
  double kinetic = 0, elastic = 0, gravity = 0;  // J
};

// Implicit substeps in which a step failed at every length, so that bodies went on without speed.
struct CreepReport {
  long substeps = 0;
  std::vector<bool> bodies;  // which ones, in any of them
};

// A body whose tissue allows no substep; what() names it.
struct TissueRefused : std::runtime_error {
  int body;
  TissueRefused(int which, const std::string& why) : std::runtime_error(why), body(which) {}
};

struct WorldData;  // arrays laid out for the step; physics/dynamics/world_data.h

class World {
 public:
  // Throws std::runtime_error naming the body where a description cannot be simulated (range of a tissue value, a fixed
  // sphere that does not exist, a body without spheres), or where settings or a static shape are out of range; of a
  // body too stiff for any substep TissueRefused.
  World(const WorldSettings& settings, std::vector<BodyDescription> bodies,
        const std::vector<StaticShape>& statics = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const std::vector<BodyDescription>& bodies() const;
  int substepsPerFrame() const;
  double substep() const;        // s
  double stableSubstep() const;  // s, the estimate of the largest stable step
  double time() const;           // s; below 0 until the settling frames are through
  // One dynamics frame: substeps under gravity and `loads`. Returns the N s that each tool gave to the bodies (index:
  // tool; up to the last that `loads` name). Throws NotFinite naming body, time and cause when the state stops being
  // finite.
  std::vector<Eigen::Vector3d> advance(const Loads& loads);

  void readFrame(DynamicsFrame& out) const;  // resized once and reused
  Energies energies() const;                 // evaluates the attachments anew: not beside any other call
  double volumeRatio(int body) const;        // enclosed by the nodes, over rest; 1 without nodes
  double lowestFrequency(int body) const;    // rad/s, of what deforms at rest; 0: nothing does
  // Per body and node, within one dynamics frame: of all at once, since it takes as long as to make the world.
  std::vector<std::vector<NodeGive>> nodeGive() const;
  int dynamicNodes(int body) const;  // that moved by themselves in the last frame: none on a skin or asleep
  // What contact has let through so far; who overlapped before anything moved, each pair of bodies once, in order.
  PenetrationReport penetration() const;
  const std::vector<BodyOverlap>& startOverlaps() const;
  const CreepReport& creep() const;
  // Whether two cells that an identified link joins have ever been turned against each other by more than 90
  // degrees: no tissue's are. Links and skin are fitted to small turns, and let a cell go over under loads of more than
  // Young's modulus over its surface.
  bool hasTurnedOver(int body) const;
  std::uint64_t stateHash() const;  // FNV-1a over every state variable's bits

  WorldData& data() { return *data_; }  // for tortures, tests and benchmarks: states that no scene can reach
  const WorldData& data() const { return *data_; }

 private:
  std::unique_ptr<WorldData> data_;
};

}  // namespace medulla
