#pragma once

#include <array>
#include <span>

#include "haptics/buckets.h"
#include "haptics/tool_input.h"

// The virtual proxy (paper 4; Ruspini, Kolarov and Khatib 1997): a sphere that follows the device but never enters a
// surface. Lengths in metres, world frame.
namespace medulla {

struct ProxyContact {
  int triangle = -1;
  Eigen::Vector3d weights;  // barycentric, of the touched point
  Eigen::Vector3d point;    // where the touched point was at the last tick
  Eigen::Vector3d normal;   // unit, from the point to the proxy's centre
  double share = 0;         // of the contact force, 0..1, sum over the contacts 1
};

struct Proxy {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double toolRadius = 0;
  double radius = 0;  // the tool's; less while surfaces leave no room for it: a squeezed proxy shrinks, never tunnels
  bool slipping = true;
  double wedging = 1;  // what presses on what it touches, summed, over their common push: more than 1 in a groove
  Eigen::Vector3d slideDirection = Eigen::Vector3d::Zero();  // unit, in which it slipped last in this contact, or zero
  // m; as if by the smooth surface that the mesh stands for (force_shading.h), the proxy is felt at centre + shading.
  Eigen::Vector3d shading = Eigen::Vector3d::Zero();
  Eigen::Vector3d felt = Eigen::Vector3d::Zero();  // m, from the device to there, without friction; zero: not shaded
  Eigen::Vector3d drag = Eigen::Vector3d::Zero();  // m, what friction adds to that
  Eigen::Vector3d device = Eigen::Vector3d::Zero(), surfaceMotion = Eigen::Vector3d::Zero();  // m, of the last tick
  bool lookNext = false;  // whether it is outside, if the next tick finds it without a contact
  int lastBucket = -1;    // where the last sweep ended: the next is likely to end there, too
  int contactCount = 0;
  std::array<ProxyContact, 3> contacts;

  bool inContact() const { return contactCount > 0; }
  std::span<const ProxyContact> touched() const { return std::span(contacts).first(contactCount); }
  // The contact that presses most; only in contact.
  const ProxyContact& mainContact() const;
  // Unit; along which it is pushed where there is no friction; only in contact.
  Eigen::Vector3d feltNormal() const;
};

// A proxy at the device, or, when that is inside of a body, just outside at the nearest point of its surface, small, to
// grow as it is pushed out.
Proxy placeProxy(const Buckets& buckets, const Eigen::Vector3d& device, double toolRadius);

// The surface moves from alphaBefore to alpha (of the same two frames) and takes the proxy along: carried by what it
// touches, never passed over, pushed out of what came too near. Throws NotFinite where it would be carried beyond
// kToolReach.
void followSurface(const Buckets& buckets, double alphaBefore, double alpha, Proxy& proxy);

// The device moves while the surface stands at alpha: the proxy goes to the nearest reachable point, held back by
// Coulomb friction. Afterwards its contacts are those that press. `tickDuration`, s.
void followDevice(const Buckets& buckets, double alpha, const ToolSettings& tool, const Eigen::Vector3d& device,
                  double tickDuration, Proxy& proxy);

}  // namespace medulla
