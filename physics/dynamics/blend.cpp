#include <cassert>

#include "physics/dynamics/frame.h"

namespace medulla {

static Eigen::Quaterniond blendOrientation(const Eigen::Quaterniond& from, const Eigen::Quaterniond& to, double alpha) {
  // Frames are at most 50 ms apart: normalised linear interpolation is within 1e-4 rad of slerp below 10 degrees and
  // costs no trigonometry.
  const double sign = from.dot(to) < 0 ? -1 : 1;
  return Eigen::Quaterniond((1 - alpha) * from.coeffs() + alpha * sign * to.coeffs()).normalized();
}

void blendFrames(const DynamicsFrame& from, const DynamicsFrame& to, double alpha, DynamicsFrame& out) {
  assert(from.bodies.size() == to.bodies.size());
  out.time = (1 - alpha) * from.time + alpha * to.time;
  out.bodies.resize(from.bodies.size());
  for (std::size_t b = 0; b < from.bodies.size(); ++b) {
    const BodyFrame &f = from.bodies[b], &t = to.bodies[b];
    BodyFrame& o = out.bodies[b];
    o.nodes.resize(f.nodes.size());
    o.spheres.resize(f.spheres.size());
    for (std::size_t i = 0; i < f.nodes.size(); ++i) o.nodes[i] = blendPoint(f.nodes[i], t.nodes[i], alpha);
    for (std::size_t i = 0; i < f.spheres.size(); ++i) {
      o.spheres[i].position = blendPoint(f.spheres[i].position, t.spheres[i].position, alpha);
      o.spheres[i].worldFromSphere =
          blendOrientation(f.spheres[i].worldFromSphere, t.spheres[i].worldFromSphere, alpha);
    }
  }
}

}  // namespace medulla
