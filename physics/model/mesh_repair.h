#pragma once

#include <string>
#include <vector>

#include "physics/model/triangle_mesh.h"

namespace medulla {

// A mesh that a model can be built on: closed, manifold, one component (nested cavities included), outward.
struct RepairedMesh {
  TriangleMesh mesh;
  std::vector<int> vertexOfInput;  // index in `mesh` of every input vertex, -1 where dropped
  std::vector<std::string> notes;  // what was repaired or is worth a warning, one sentence each; empty for a clean mesh
};

// Throws std::runtime_error saying what is wrong and what was expected where repair would be guesswork.
RepairedMesh repairMesh(const TriangleMesh& input);

}  // namespace medulla
