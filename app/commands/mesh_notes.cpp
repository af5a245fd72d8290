#include "app/commands/mesh_notes.h"

#include "app/files/text.h"
#include "app/standard_streams.h"
#include "physics/model/mesh_topology.h"

namespace medulla {

void noteSize(const std::string& path, const TriangleMesh& mesh) {
  const double size = boundsDiagonal(mesh);
  if (size > 5 || size < 0.005) tell("{}: note: the mesh is {:.3g} m across; is --unit right?\n", path, size);
}

void noteRepairs(const std::string& path, const std::vector<std::string>& notes) {
  if (!notes.empty()) tell("{}: mesh repair: {}\n", path, joined(notes, "; "));
}

}  // namespace medulla
