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

Pivot pivotOf(const WorldData& d, int body) {
  const BodyRange& r = d.ranges[body];
  Pivot out{r.support.freedom};
  if (isFree(r)) return out;
  const auto placeOf = [&](const SupportPoint& p) {
    return p.sphere >= 0 ? vectorOf(d.spheres.position[r.firstSphere + p.sphere])
                         : vectorAt(d.nodes.position, r.node[p.node]);
  };
  const SupportPoint& point = r.support.point;
  out.point = placeOf(point);
  if (point.sphere >= 0) out.velocity = vectorOf(d.spheres.velocity[r.firstSphere + point.sphere]);
  if (out.freedom == RigidFreedom::aboutLine) out.line = placeOf(r.support.second) - out.point;
  return out;
}

Vector3d spinMomentum(const WholeMotion& whole, const Pivot& pivot) {
  if (pivot.freedom == RigidFreedom::all) return whole.angular - whole.moment.cross(whole.linear) / whole.mass;
  const Vector3d moment = whole.moment - whole.mass * pivot.point;
  return whole.angular - pivot.point.cross(whole.linear) - moment.cross(pivot.velocity);
}

RigidMotion rigidMotionOf(const WholeMotion& whole, const Pivot& pivot) {
  const Vector3d centre = whole.moment / whole.mass, momentum = spinMomentum(whole, pivot);
  const Matrix3d own = whole.inertia - whole.mass * inertiaAt(centre);
  if (pivot.freedom == RigidFreedom::all) return {centre, whole.linear / whole.mass, own.inverse() * momentum};
  const Matrix3d inertia = own + whole.mass * inertiaAt(centre - pivot.point);
  const Vector3d& line = pivot.line;
  const Vector3d spin = pivot.freedom == RigidFreedom::aboutPoint
                            ? Vector3d(inertia.inverse() * momentum)
                            : Vector3d(line.dot(momentum) / line.dot(inertia * line) * line);
  return {pivot.point, pivot.velocity, spin};
}

void addMomenta(WorldData& d, int body, const WholeMotion& now, const Vector3d& linear, const Vector3d& angular) {
  WholeMotion added = now;
  added.linear = linear;
  added.angular = angular;
  Pivot pivot = pivotOf(d, body);
  pivot.velocity.setZero();
  const RigidMotion motion = rigidMotionOf(added, pivot);
  const Vector3d& spin = motion.spin;
  const BodyRange& r = d.ranges[body];
  for (const int i : spheresOf(r)) {
    if (d.spheres.groups[i / 4].inverseMass[i % 4] > 0)
      addTo(d.spheres.velocity[i], load(quadOf(velocityAt(motion, vectorOf(d.spheres.position[i])))));
    d.spheres.angularVelocity[i] = quadOf(vectorOf(d.spheres.angularVelocity[i]) + spin);
    d.spheres.angularMomentum[i] = quadOf(vectorOf(d.spheres.angularMomentum[i]) + inertiaOf(d, i) * spin);
  }
  // Those of a skin have no velocity: nothing would take back what each attempt at a step left there.
  for (const int i : r.node)
    if (i < d.nodes.dynamicEnd && (d.nodes.inverseMass[i] > 0 || d.nodes.mass[i] == 0))
      setVector(d.nodes.velocity, i, vectorAt(d.nodes.velocity, i) + velocityAt(motion, vectorAt(d.nodes.position, i)));
}

void slowDown(WorldData& d, int body, const RigidMotion& against, double share) {
  const auto slowed = [&](const Vector3d& now, const Vector3d& to) { return Vector3d(to + share * (now - to)); };
  Spheres& s = d.spheres;
  const BodyRange& r = d.ranges[body];
  for (const int i : spheresOf(r)) {
    s.velocity[i] = quadOf(slowed(vectorOf(s.velocity[i]), velocityAt(against, vectorOf(s.position[i]))));
    s.angularVelocity[i] = quadOf(slowed(vectorOf(s.angularVelocity[i]), against.spin));
    s.angularMomentum[i] = quadOf(slowed(vectorOf(s.angularMomentum[i]), inertiaOf(d, i) * against.spin));
  }
  for (const int i : r.node)
    if (i < d.nodes.dynamicEnd)
      setVector(d.nodes.velocity, i,
                slowed(vectorAt(d.nodes.velocity, i), velocityAt(against, vectorAt(d.nodes.position, i))));
}

void turn(WorldData& d, int body, const WholeMotion& now, const Vector3d& angle) {
  const Pivot pivot = pivotOf(d, body);
  const RigidMotion motion = rigidMotionOf(now, pivot);
  const Vector3d centre = motion.centre, velocity = motion.velocity;
  const double size = angle.norm();
  if (!(size > 0)) return;
  const Eigen::AngleAxisd rotation(size, angle / size);
  const Matrix3d by = rotation.toRotationMatrix();
  const auto turned = [&](const Quad& q) { return quadOf(by * vectorOf(q)); };
  Spheres& s = d.spheres;
  const BodyRange& r = d.ranges[body];
  for (const int i : spheresOf(r)) {
    s.position[i] = quadOf(centre + by * (vectorOf(s.position[i]) - centre));
    s.velocity[i] = quadOf(velocity + by * (vectorOf(s.velocity[i]) - velocity));
    s.angularVelocity[i] = turned(s.angularVelocity[i]);
    s.angularMomentum[i] = turned(s.angularMomentum[i]);
    const Eigen::Quaterniond q = (Eigen::Quaterniond(rotation) * quaternionOf(s.orientation[i])).normalized();
    s.orientation[i] = {{q.x(), q.y(), q.z(), q.w()}};
  }
  for (const int i : r.node) {
    if (i >= d.nodes.dynamicEnd) continue;
    setVector(d.nodes.position, i, centre + by * (vectorAt(d.nodes.position, i) - centre));
    setVector(d.nodes.velocity, i, velocity + by * (vectorAt(d.nodes.velocity, i) - velocity));
  }
  const Vector3d spin = spinMomentum(now, pivot);
  WholeMotion then = now;  // about the same centre
  const Matrix3d own = now.inertia - now.mass * inertiaAt(now.moment / now.mass);
  then.moment = now.mass * (centre + by * (now.moment / now.mass - centre));
  then.inertia = by * own * by.transpose() + now.mass * inertiaAt(then.moment / now.mass);
  addMomenta(d, body, then, Vector3d::Zero(), spin - by * spin);
}

}  // namespace medulla
