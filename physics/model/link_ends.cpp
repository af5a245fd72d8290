#include "physics/model/link_ends.h"

#include <cmath>

#include "physics/model/link_graph.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/plane_section.h"

namespace medulla {

using Eigen::Vector3d;

namespace {

// m, how far from `start` along the unit vector `way` the section keeps at least half of its area there.
double reachOf(const TriangleMesh& mesh, const SurfaceTree& tree, const PowerSites& around, const Vector3d& start,
               const Vector3d& way, double extent) {
  constexpr int kStations = 16;
  constexpr double kLeastArea = 0.5;
  const double toSurface = firstHit(tree, start, way, extent);
  if (!std::isfinite(toSurface)) return 0;
  const auto areaAt = [&](double distance) {
    Plane plane = planeAcross(start, way);
    plane.origin += distance * way;
    return planeSection(mesh, plane, &around, {0, 1}).area;
  };
  const double least = kLeastArea * areaAt(0);
  int reached = 0;
  while (reached < kStations && areaAt((reached + 0.5) / kStations * toSurface) >= least) ++reached;
  return reached * toSurface / kStations;
}

}  // namespace

void placeLinkEnds(const TriangleMesh& mesh, const SurfaceTree& tree, const PowerSites& sites,
                   const std::vector<ElasticLink>& links, std::vector<FillingSphere>& spheres) {
  const std::vector<int> counts = linkCounts(spheres.size(), links);
  std::vector<int> neighbour(spheres.size(), -1);
  for (const ElasticLink& link : links) {
    neighbour[link.sphere0] = link.sphere1;
    neighbour[link.sphere1] = link.sphere0;
  }
  const double diagonal = boundsDiagonal(mesh);
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    spheres[i].restLinkEnd = spheres[i].restFrame;
    if (counts[i] != 1) continue;
    const Vector3d way = (spheres[i].restFrame - spheres[neighbour[i]].restFrame).normalized();
    const PowerSites around = sitesAround(sites, {static_cast<int>(i), neighbour[i]});
    spheres[i].restLinkEnd += reachOf(mesh, tree, around, spheres[i].restFrame, way, diagonal) * way;
  }
}

}  // namespace medulla
