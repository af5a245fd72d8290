#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "haptics/grab.h"
#include "haptics/motion_error.h"
#include "haptics/proxy.h"

// Where touched or held tissue is by now, ahead of the blended surface, which is a frame late. Two things are known:
// how far the tissue moved in each of the past frames (its steps), and how the device moves. Tissue follows the device
// by a fraction that its compliance tells. Past steps already contain the response to the device's displacement of
// those frames; only displacement beyond that (a first touch, a change of speed) is added, times that fraction. Steps
// alone make a first touch on soft tissue twenty times too hard for two frames.
namespace medulla {

// Of one device while it touches; while it holds, of the mean of where it wants what it holds, which turns with it.
struct DeviceMotion {
  double least = 1e-12;                                // m2: ways whose squares come to less are as if it stood still
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, over the last tick
  // m: the way that counts, in this dynamics frame so far and in the three before; from where the path that the
  // dynamics was given ended to where it ended next, of a contact along its normal.
  std::array<Eigen::Vector3d, 4> way{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                     Eigen::Vector3d::Zero()};
  std::array<Eigen::Vector3d, 4> wayAcross = way;  // m, likewise, across the normal of a contact
  // alpha from which on the device's own way counts, in this frame and in the one before; and m, what of the way came
  // earlier in these frames, evenly, of tissue that had moved by itself.
  double since = 0, sinceBefore = 0;
  Eigen::Vector3d early = Eigen::Vector3d::Zero(), earlyBefore = Eigen::Vector3d::Zero();
  // The fraction of the device's displacement that touched or held tissue follows: at once, by its compliance; and as
  // observed up to the surface's `to` and `from`.
  double followsAtOnce = 0;
  int frames = 0;  // that began since it touches or holds
  std::array<double, 2> follows{};
  // m2, sums over frames, of which older ones fade: step's change times the change of the way that it answers, and the
  // latter's square; and what the tissue's force changed by, over the tool's stiffness, times the length that tissue or
  // device went, and the latter's square. They outlast a contact: what comes back soon, of the same body, is likely the
  // same tissue.
  struct {
    double stepChange = 0, wayChange = 0, forceLength = 0, length = 0;
  } seen{};
  // How what a grip holds swings by itself: of a vibration by an angle theta per frame about an even motion, a step and
  // the one before the last make 2 cos(theta) times the last, and a constant; 2 and none is what speeds up evenly. Sums
  // over fading frames for least squares of that: their number, squares of the last (m2), its products with the two
  // (m2), the last and the two (m); and what they say, up to the surface's `to` and `from`.
  struct {
    double frames = 0, square = 0, product = 0;
    Eigen::Vector3d last = Eigen::Vector3d::Zero(), both = Eigen::Vector3d::Zero();
  } swung{};
  struct Swing {
    double turn = 2;                                  // 2 cos(theta)
    Eigen::Vector3d drift = Eigen::Vector3d::Zero();  // m
  };
  std::array<Swing, 2> swing{};
  MotionError error{};
};

// Tissue that moved by itself begins to follow the device: its steps so far count as answers to ways of a device.
void beginContact(const BlendedSurface& surface, double alpha, const ProxyContact& contact,
                  const Eigen::Vector3d& normal, double stiffness, DeviceMotion& device);
void beginHold(const BlendedSurface& surface, double alpha, const Grip& grip, double stiffness, DeviceMotion& device);
// `lag`, m: how far the device is ahead of the end of the path that the dynamics was given. Tissue answers that path,
// not the device: straight and with the frame's mean kept, it ends a T^2 / 12 behind a device that speeds up by a. Ways
// of the device itself would leave a body that follows it behind by as much, felt as a mass of k T^2 / 12 more.
// `duration`, s: of the frame that ended.
void startFrame(const Eigen::Vector3d& lag, double duration, DeviceMotion& device);
// How far what is touched or held follows, by the frame that begins. Its give tells what yields with the spheres still,
// within a frame; a limp organ swings along within a few, a free body goes all the way. Two things show it, and the
// larger counts:
// - least squares of the tissue's steps' changes by those of the ways that they answer. Steady ways tell nothing, as
//   tissue may drift by itself.
// - of a contact, how much its force changes per length that it or the device went, against the tool's stiffness:
//   tissue that swings on its own, or has been knocked off, has steps that answer no way, but little force.
// Neither does in a frame in whose second half it was touched.
// `forceChange`, N: of the tissue's force along `normal`, over the frame that ended; 0 where it is not known.
void learnFollowing(const BlendedSurface& surface, std::span<const ProxyContact> contacts,
                    const Eigen::Vector3d& normal, double stiffness, double forceChange, DeviceMotion& device);
void learnFollowing(const BlendedSurface& surface, const Grip& grip, DeviceMotion& device);

struct TissueMotion {
  Eigen::Vector3d lead = Eigen::Vector3d::Zero();      // m, by now ahead of the blended surface
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // m/s, by now
  // What it moves within a frame, m, and the part of the device's way by which it follows.
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  double followed = 0;
};

// Mean over contacts that share a push along `normal`. The steps are in all directions, what lies beyond them along the
// normal: along the surface, friction lets tissue follow or not.
TissueMotion contactMotion(const BlendedSurface& surface, double alpha, std::span<const ProxyContact> contacts,
                           const Eigen::Vector3d& normal, const DeviceMotion& device);

// Of the device, in the frame's duration up to alpha.
WayAndChange recentWays(const DeviceMotion& device, double alpha);

// N: by how much a push along `normal` can differ from what it was BlendedSurface::toolForceAge ago: by what device and
// tissue went since and the stiffness of tool and tissue in series, and by the tool's damper.
double pushSince(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, const Eigen::Vector3d& normal,
                 const ToolSettings& tool, const DeviceMotion& device);

// N: likewise of the drag across `normal`: by what the device went off the tissue since, on either side of what
// friction holds.
double dragSince(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, const Eigen::Vector3d& normal,
                 const ToolSettings& tool, const DeviceMotion& device);

// N: likewise of a grip's force, in any direction, and by twice what the tissue's force lately changed by in a frame,
// `changePerFrame` (N): a body that follows all the way changes it by its mass alone, which no stiffness tells.
double heldSince(const BlendedSurface& surface, double alpha, const TissueMotion& tissue, double changePerFrame,
                 const ToolSettings& tool, const DeviceMotion& device);

// Mean over what a grip holds. It leads by the next step, as it swings: by twice the last less the one before, what a
// stiff grip holds was felt two or three times too hard where it vibrates with some frames to the period, as a ball of
// 32 g held by 2 kN/m does at 50 Hz.
TissueMotion heldMotion(const BlendedSurface& surface, double alpha, const Grip& grip, const DeviceMotion& device);

}  // namespace medulla
