#include "physics/model/mesh_repair.h"

#include <utility>

#include "physics/model/mesh_repair_stages.h"

namespace medulla {

RepairedMesh repairMesh(const TriangleMesh& input) {
  requireUsableNumbers(input);
  requireNoFarVertex(input);
  MeshUnderRepair repair = weldVertices(input);
  dropRepeatedTriangles(repair);
  dropFins(repair);
  dropUnusedVertices(repair);
  requireThickness(repair);
  requireManifoldEdges(repair);
  orientNeighboursAlike(repair);
  fillSmallHoles(repair);
  splitPinchedVertices(repair);
  flipTrianglesWithoutArea(repair);
  requireApart(repair);
  orientBodyAndCavities(repair);
  requireVolume(repair);
  judgeSelfIntersections(repair);
  return {std::move(repair.mesh), std::move(repair.vertexOfInput), std::move(repair.notes)};
}

}  // namespace medulla
