#include "physics/dynamics/whole_motion.h"

#include <Eigen/Dense>

#include "physics/dynamics/stages.h"
#include "physics/model/mass_properties.h"

namespace medulla {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

void addMass(double mass, const Vector3d& at, const Vector3d& velocity, WholeMotion& to) {
  to.mass += mass;
  to.moment += mass * at;
  to.linear += mass * velocity;
  to.angular += mass * at.cross(velocity);
  to.inertia += mass * inertiaAt(at);
}

Matrix3d inertiaOf(const WorldData& d, int sphere) {
  const Matrix3d r = quaternionOf(d.spheres.orientation[sphere]).toRotationMatrix();
  return r * inverseInertiaOf(d.spheres.groups[sphere / 4], sphere % 4).inverse() * r.transpose();
}

}  // namespace

void wholeMotions(const WorldData& d, std::vector<WholeMotion>& out) {
  out.assign(d.bodies.size(), {});
  for (const Batch& batch : d.awake.batches) {
    for (const int b : batch.bodies) {
      for (const int i : spheresOf(d.ranges[b])) {
        addMass(d.spheres.groups[i / 4].mass[i % 4], vectorOf(d.spheres.position[i]), vectorOf(d.spheres.velocity[i]),
                out[b]);
        out[b].angular += vectorOf(d.spheres.angularMomentum[i]);
        out[b].inertia += inertiaOf(d, i);
      }
    }
    for (const std::vector<HostRange>* ranges : {&batch.onLinks, &batch.onSpheres})
      for (const HostRange& range : *ranges)
        for (int i = 4 * range.firstGroup; i < 4 * range.endGroup; ++i)
          addMass(d.nodes.mass[i], vectorAt(d.nodes.position, i), vectorAt(d.nodes.velocity, i), out[range.body]);
  }
}

RigidMotion rigidMotionOf(const WholeMotion& whole) {
  const Vector3d centre = whole.moment / whole.mass;
  const Matrix3d inertia = whole.inertia - whole.mass * inertiaAt(centre);
  return {centre, whole.linear / whole.mass, inertia.inverse() * spinMomentum(whole)};
}

void addMomenta(WorldData& d, int body, const WholeMotion& now, const Vector3d& linear, const Vector3d& angular) {
  WholeMotion added = now;
  added.linear = linear;
  added.angular = angular;
  const RigidMotion motion = rigidMotionOf(added);
  const Vector3d& spin = motion.spin;
  const BodyRange& r = d.ranges[body];
  for (const int i : spheresOf(r)) {
    addTo(d.spheres.velocity[i], load(quadOf(velocityAt(motion, vectorOf(d.spheres.position[i])))));
    d.spheres.angularVelocity[i] = quadOf(vectorOf(d.spheres.angularVelocity[i]) + spin);
    d.spheres.angularMomentum[i] = quadOf(vectorOf(d.spheres.angularMomentum[i]) + inertiaOf(d, i) * spin);
  }
  for (const int i : r.node)
    setVector(d.nodes.velocity, i, vectorAt(d.nodes.velocity, i) + velocityAt(motion, vectorAt(d.nodes.position, i)));
}

}  // namespace medulla
