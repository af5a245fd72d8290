#pragma once

#include <cmath>
#include <glm/glm.hpp>

namespace medulla {

// Unit, across the unit vector w: the same one each time, not turning steadily with it.
inline glm::vec3 across(glm::vec3 w) {
  return glm::normalize(glm::cross(std::abs(w.x) < 0.7f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0), w));
}

}  // namespace medulla
