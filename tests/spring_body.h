#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "physics/dynamics/loads.h"
#include "tests/touch_shapes.h"

namespace medulla {

// A stand-in for a soft body in tests of the servo: masses on the nodes, each tied to its rest position and to its
// neighbours, all damped. The rest positions may be carried along. It takes loads as physics/dynamics/loads.h says.
struct SpringBody {
  TouchShape shape;
  double mass = 0.002, ground = 25, edge = 150, groundDamping = 0.4, edgeDamping = 0.3;  // kg, N/m, N/m, N s/m, N s/m
  std::vector<Eigen::Vector3d> position, velocity, force;
  std::vector<std::array<int, 2>> edges;
  double time = 0;
  Eigen::Vector3d carriedAt = Eigen::Vector3d::Zero();  // m/s, of the rest positions
  Eigen::Vector3d carried = Eigen::Vector3d::Zero();    // m, so far

  explicit SpringBody(TouchShape touched) : shape(std::move(touched)), position(shape->restNodes) {
    velocity.assign(position.size(), Eigen::Vector3d::Zero());
    force = velocity;
    for (const auto& triangle : shape->triangles)
      for (int k = 0; k < 3; ++k)
        if (triangle[k] < triangle[(k + 1) % 3]) edges.push_back({triangle[k], triangle[(k + 1) % 3]});
  }

  DynamicsFrame frame() const { return frameOf(time, position); }

  void addElasticForces() {
    for (std::size_t n = 0; n < position.size(); ++n)
      force[n] = ground * (shape->restNodes[n] + carried - position[n]) - groundDamping * (velocity[n] - carriedAt);
    for (const auto& [a, b] : edges) {
      const Eigen::Vector3d d = position[b] - position[a];
      const double rest = (shape->restNodes[b] - shape->restNodes[a]).norm();
      const Eigen::Vector3d f = edge * (1 - rest / d.norm()) * d + edgeDamping * (velocity[b] - velocity[a]);
      force[a] += f;
      force[b] -= f;
    }
  }

  static Eigen::Vector3d atMost(double most, const Eigen::Vector3d& f) {
    return f.norm() > most ? Eigen::Vector3d(most / f.norm() * f) : f;
  }

  // `left` s before the end of the frame. Returns the sum of the tools' forces.
  Eigen::Vector3d addToolForces(const Loads& loads, double left) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const ToolSpring& spring : loads.toolSprings) {
      Eigen::Vector3d x = Eigen::Vector3d::Zero(), v = x;
      for (int k = 0; k < 3; ++k) {
        x += spring.weights[k] * position[spring.nodes[k]];
        v += spring.weights[k] * velocity[spring.nodes[k]];
      }
      Eigen::Vector3d f = spring.stiffness * (spring.anchor - left * spring.anchorVelocity - x) +
                          spring.damping * (spring.anchorVelocity + spring.drift - v);
      f -= std::max(0.0, f.dot(spring.outward)) * spring.outward;
      if (spring.slides) {  // regularised: full friction from 1 mm/s on
        const Eigen::Vector3d push = f.dot(spring.outward) * spring.outward, slip = spring.anchorVelocity - v;
        const Eigen::Vector3d across = slip - slip.dot(spring.outward) * spring.outward;
        f = push + spring.friction * push.norm() / std::max(1e-3, across.norm()) * across;
      }
      f = atMost(spring.forceMax, f);
      for (int k = 0; k < 3; ++k) force[spring.nodes[k]] += spring.weights[k] * f;
      sum += f;
    }
    for (const HeldNode& held : loads.heldNodes) {
      const Eigen::Vector3d f =
          atMost(held.forceMax, held.stiffness * (held.anchor - left * held.anchorVelocity - position[held.node]) +
                                    held.damping * (held.anchorVelocity - velocity[held.node]));
      force[held.node] += f;
      sum += f;
    }
    return sum;
  }

  // One dynamics frame; returns the impulse that the tools gave to the body, N s.
  Eigen::Vector3d advance(const Loads& loads, double duration, int substeps) {
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero();
    const double h = duration / substeps;
    for (int s = 0; s < substeps; ++s) {
      carried += h * carriedAt;
      addElasticForces();
      impulse += h * addToolForces(loads, duration - (s + 1) * h);
      for (std::size_t n = 0; n < position.size(); ++n) {
        velocity[n] += h / mass * force[n];
        position[n] += h * velocity[n];
      }
    }
    time += duration;
    return impulse;
  }
};

}  // namespace medulla
