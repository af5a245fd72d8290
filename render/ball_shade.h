#pragma once

#include <vector>

#include "render/renderer.h"
#include "render/scene_mesh.h"

namespace medulla {

// Occlusion that moves: what balls that fill other surfaces leave of the cavity's light. A ball of radius r whose
// centre is at distance d hides cos r^2 / d^2 of it from a small patch, cos that of the angle between its normal and
// the direction to the centre (Howell's catalogue of view factors, B-42; all of the ball above the patch's horizon).
// Of one surface's balls, which overlap, it is about the most that any hides.
class BallShade {
 public:
  using Balls = std::vector<const std::vector<ShadeBall>*>;  // per part of the mesh

  // What lies at rest in places that it does not travel from, which the baked openness knows. `mesh`: at rest.
  void bake(const SceneMesh& mesh, const Balls& atRest);
  // Scales the openness of the parts that `balls` has something to say of by what they leave now, over what those at
  // rest left. What turns away from the eye stays as it is.
  void apply(const Balls& balls, glm::vec3 eye, SceneMesh& mesh);

 private:
  struct Held {
    ShadeBall ball;
    std::uint32_t part;
  };
  void sortIn(const Balls& balls);
  float leftAt(glm::vec3 position, glm::vec3 normal, std::uint32_t part) const;

  std::vector<float> left_;  // per vertex, at rest
  // A grid over all balls, and in each cell those that reach into it, part by part.
  std::vector<Held> balls_;
  glm::vec3 low_{0};
  glm::ivec3 cells_{0};
  float perMetre_ = 0;
  std::vector<std::uint32_t> first_, inCell_;
};

}  // namespace medulla
