#pragma once

#include <glm/glm.hpp>

#include "render/renderer.h"
#include "render/viewpoint.h"

namespace medulla {

// What the medium and the lamp above it do to a picture: light from all sides, and light ripples.
class HazeField {
 public:
  // Needs light.haze. `time` in s moves ripples and shafts.
  HazeField(const Light& light, const Camera& camera, float time);
  // Linear RGB that comes from far away along a unit vector: brighter from above; with shafts about the lamp where the
  // light is rippled.
  glm::vec3 toward(glm::vec3 direction) const;
  // Light from all sides on a surface that faces down or up.
  glm::vec3 below() const;
  glm::vec3 above() const;
  // Share of a surface's light that is lost to the medium at distance d, m.
  float veil(float distance) const;

 private:
  glm::vec3 colour_, lamp_, aside_, across_;  // unit vectors to the lamp and about it
  float distance_, shafts_, time_;
};

// Factor on the lamp's light at p, about 1 on average: the net of bright lines that waves on the water above focus,
// carried along the light. `contrast` 0 to 1.
float causticAt(glm::vec3 p, glm::vec3 toLight, float contrast, float time);

// Fills what no surface covers.
class HazePass {
 public:
  HazePass();
  ~HazePass();
  HazePass(const HazePass&) = delete;
  HazePass& operator=(const HazePass&) = delete;
  void draw(const Viewpoint& view, const HazeField& haze);

 private:
  unsigned program_ = 0, vertexArray_ = 0, vertices_ = 0, indices_ = 0;
  int indexCount_ = 0;
};

}  // namespace medulla
