#pragma once

#include <algorithm>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "physics/dynamics/world_data.h"
#include "tests/synthetic_model.h"

// Bodies of few balls and no surface, whose contacts have closed forms.
namespace medulla::synthetic {

struct BallAndRadius {
  Vector3d centre;
  double radius;
};

// Homogeneous balls with links of their own thickness between the pairs of `links`; no nodes.
inline std::shared_ptr<SoftBodyModel> ballModel(const std::vector<BallAndRadius>& balls,
                                                const std::vector<std::pair<int, int>>& links = {}) {
  auto model = std::make_shared<SoftBodyModel>();
  model->name = "balls";
  for (const BallAndRadius& b : balls) {
    FillingSphere s;
    s.restBallCentre = s.restFrame = s.restLinkEnd = b.centre;
    s.radius = b.radius;
    s.volume = 4.0 / 3 * std::numbers::pi * b.radius * b.radius * b.radius;
    s.secondMoment = s.volume * b.radius * b.radius / 5 * Matrix3d::Identity();
    model->spheres.push_back(s);
  }
  for (const auto& [a, b] : links) addLink(*model, a, b, std::min(balls[a].radius, balls[b].radius));
  return model;
}

inline BodyDescription ballBody(std::string name, std::shared_ptr<const SoftBodyModel> model, const Vector3d& position,
                                double friction = 0) {
  BodyDescription b = body(std::move(model), 2e4);
  b.name = std::move(name);
  b.tissue.friction = friction;
  b.worldFromModel.translation() = position;
  return b;
}

inline BodyDescription ball(std::string name, double radius, const Vector3d& position, double friction = 0) {
  return ballBody(std::move(name), ballModel({{Vector3d::Zero(), radius}}), position, friction);
}

inline void throwBody(World& w, int body, const Vector3d& velocity) {
  WorldData& d = w.data();
  const BodyRange& r = d.ranges[body];
  for (int i = r.firstSphere; i < r.firstSphere + r.sphereCount; ++i) d.spheres.velocity[i] = quadOf(velocity);
  for (const int n : r.node)
    if (n < d.nodes.dynamicEnd) setVector(d.nodes.velocity, n, velocity);
}

}  // namespace medulla::synthetic
