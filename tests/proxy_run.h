#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "haptics/buckets.h"
#include "haptics/servo.h"
#include "haptics/swept_triangle.h"
#include "physics/model/mesh_topology.h"
#include "tests/tool_run.h"
#include "tests/touch_shapes.h"

namespace medulla {

constexpr double tickDuration = 1e-3;

// A scripted device against a scripted surface: what the servo makes of it, without any dynamics.
struct ProxyRun {
  using Each = std::function<void(double time, const ToolState&, const BlendedSurface&, double alpha)>;

  TouchShape shape;
  std::function<Eigen::Vector3d(double time)> device;
  SurfaceMotion motion;  // empty: the surface rests
  ToolSettings tool;
  double duration = 1;
  int ticksPerFrame = 20;

  ProxyRun() { tool.damping = tool.staticFriction = tool.dynamicFriction = 0; }

  // `each` sees every tick with the surface as the servo blends it: one frame late (paper 5).
  void run(const Each& each) const {
    const double frameDuration = ticksPerFrame * tickDuration;
    DynamicsFrame from = frameAt(*shape, 0, motion), to = from;
    Servo servo({{shape}}, {tool}, tickDuration, from, {deviceAt(device(0))});
    BlendedSurface seen;
    seen.triangles = shape->triangles;
    const int ticks = int(std::lround(duration / tickDuration));
    for (int n = 1; n <= ticks; ++n) {
      const int within = (n - 1) % ticksPerFrame;
      if (within == 0 && n > 1) {
        from = to;
        to = motion ? frameAt(*shape, (n - 1) * tickDuration, motion) : to;
        to.time = from.time + frameDuration;
        servo.commit(from, to, servo.tools());
        servo.beginFrame();
      }
      if (within == 0) {
        seen.from = from.bodies[0].nodes;
        seen.to = to.bodies[0].nodes;
      }
      const double alpha = (within + 1.0) / ticksPerFrame;
      servo.tick(alpha, {deviceAt(device(n * tickDuration))});
      each(n * tickDuration, servo.tools()[0], seen, alpha);
    }
  }
};

// Distance from p to the nearest triangle, or `within` where that is more.
inline double clearance(const BlendedSurface& surface, double alpha, const Eigen::Vector3d& p, double within) {
  double nearest = within;
  for (int t = 0; t < int(surface.triangles.size()); ++t) {
    const Triangle triangle = surface.triangle(t, alpha);
    const Eigen::Vector3d middle = (triangle.a + triangle.b + triangle.c) / 3;
    const double size2 = std::max({(triangle.a - middle).squaredNorm(), (triangle.b - middle).squaredNorm(),
                                   (triangle.c - middle).squaredNorm()});
    if ((p - middle).norm() > std::sqrt(size2) + nearest) continue;
    nearest = std::min(nearest, (closestPoint(triangle, p).point - p).norm());
  }
  return nearest;
}

inline bool isInside(const BlendedSurface& surface, double alpha, const Eigen::Vector3d& p) {
  double winding = 0;
  for (int t = 0; t < int(surface.triangles.size()); ++t) {
    const Triangle triangle = surface.triangle(t, alpha);
    winding += solidAngle(triangle.a, triangle.b, triangle.c, p) / (4 * std::numbers::pi);
  }
  return winding > 0.5;
}

}  // namespace medulla
