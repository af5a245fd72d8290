#include "assets/shapes/remesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "assets/shapes/editable_mesh.h"
#include "assets/shapes/mesh_check.h"

namespace medulla {

using Eigen::Vector3d;

struct Remeshing {
  const SignedDistance& sdf;
  RemeshSettings settings;
  EditableMesh mesh;
  std::vector<double> relativeLength;  // per vertex, 0..1: wanted edge length over edgeLength
  std::vector<bool> onRim;             // per vertex: the surface turns by more than a radian over an edge
  double edgeLength = 1;               // mm
};

static double wantedLength(const Remeshing& r, int a, int b) {
  return 0.5 * r.edgeLength * (r.relativeLength[a] + r.relativeLength[b]);
}

static double edgeRatio(const Remeshing& r, int a, int b) {
  return (r.mesh.positions[a] - r.mesh.positions[b]).norm() / wantedLength(r, a, b);
}

// Larger principal curvature (1/mm, absolute) from the turning of the normal `reach` mm around: finer detail than that
// the mesh cannot show.
static double curvatureAt(const SignedDistance& sdf, const Vector3d& p, double reach) {
  const Vector3d normal = normalAt(sdf, p), u = normal.unitOrthogonal(), v = normal.cross(u);
  const Vector3d turnU = (normalAt(sdf, p + reach * u) - normalAt(sdf, p - reach * u)) / (2 * reach);
  const Vector3d turnV = (normalAt(sdf, p + reach * v) - normalAt(sdf, p - reach * v)) / (2 * reach);
  const double uu = turnU.dot(u), vv = turnV.dot(v), uv = 0.5 * (turnU.dot(v) + turnV.dot(u));
  const double half = std::sqrt(0.25 * (uu - vv) * (uu - vv) + uv * uv);
  return std::abs(0.5 * (uu + vv)) + half;
}

static void updateRelativeLengths(Remeshing& r) {
  EditableMesh& mesh = r.mesh;
  const double reach = std::max(0.5, (r.settings.keepRims ? 0.1 : 0.25) * r.edgeLength);
  r.relativeLength.assign(mesh.positions.size(), 1);
  r.onRim.assign(mesh.positions.size(), false);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (mesh.trianglesOf[v].empty()) continue;
    const double curvature = curvatureAt(r.sdf, mesh.positions[v], reach);
    const double relative = std::sqrt(1 / std::max(r.settings.fullSizeRadius * curvature, 1e-6));
    r.relativeLength[v] = std::clamp(relative, r.settings.smallestRelative, 1.0);
    r.onRim[v] = r.settings.keepRims && curvature * r.edgeLength * r.relativeLength[v] > 1;
  }
  // Neighbouring edges may differ by half: graded sizes keep triangles near equilateral.
  for (int pass = 0; pass < 6; ++pass) {
    for (const auto& [a, b] : edgesOf(mesh)) {
      const double step = 0.45 * (mesh.positions[a] - mesh.positions[b]).norm() / r.edgeLength;
      r.relativeLength[a] = std::min(r.relativeLength[a], r.relativeLength[b] + step);
      r.relativeLength[b] = std::min(r.relativeLength[b], r.relativeLength[a] + step);
    }
  }
}

// Edge length at which equilateral triangles of the wanted relative sizes cover the surface in the wanted number.
static double edgeLengthForCount(const Remeshing& r) {
  double area = 0;  // in units of the local relative triangle
  for (std::size_t t = 0; t < r.mesh.triangles.size(); ++t) {
    const auto& v = r.mesh.triangles[t];
    if (v[0] < 0) continue;
    const double relative = (r.relativeLength[v[0]] + r.relativeLength[v[1]] + r.relativeLength[v[2]]) / 3;
    area += 0.5 * doubleAreaVector(r.mesh, static_cast<int>(t)).norm() / (relative * relative);
  }
  return std::sqrt(area / (std::sqrt(3.0) / 4 * r.settings.triangles));
}

static bool split(Remeshing& r, int a, int b) {
  const EdgeSides sides = sidesOf(r.mesh, a, b);
  if (!sides.valid) return false;
  const Vector3d &p = r.mesh.positions[a], &q = r.mesh.positions[b];
  Vector3d middle = projectToSurface(r.sdf, 0.5 * (p + q), 0.5 * (p - q).norm());
  splitEdge(r.mesh, sides, a, b, middle);
  r.relativeLength.push_back(0.5 * (r.relativeLength[a] + r.relativeLength[b]));
  r.onRim.push_back(r.onRim[a] && r.onRim[b]);
  return true;
}

// A collapse must turn no triangle by more than 60 degrees, spoil none, and make no edge longer than maxRatio.
static bool collapseIsGood(const Remeshing& r, const EdgeSides& sides, int a, int b, const Vector3d& position,
                           double maxRatio) {
  const EditableMesh& mesh = r.mesh;
  for (const int centre : {a, b}) {
    for (const int t : mesh.trianglesOf[centre]) {
      if (t == sides.triangle[0] || t == sides.triangle[1]) continue;
      std::array<Vector3d, 3> x;
      for (int k = 0; k < 3; ++k) {
        const int v = mesh.triangles[t][k];
        x[k] = v == a || v == b ? position : mesh.positions[v];
      }
      const Vector3d before = doubleAreaVector(mesh, t), after = (x[1] - x[0]).cross(x[2] - x[0]);
      if (before.dot(after) <= 0.5 * before.norm() * after.norm()) return false;
      if (triangleQuality(x[0], x[1], x[2]) < std::min(0.3, 0.9 * quality(mesh, t))) return false;
      const double limit = maxRatio * wantedLength(r, a, b);
      for (int k = 0; k < 3; ++k)
        if ((x[k] - x[(k + 1) % 3]).norm() > limit) return false;
    }
  }
  return true;
}

// Volume between the surface before and after a and b go to `position`.
static double sweptVolume(const EditableMesh& mesh, int a, int b, const Vector3d& position) {
  double volume = 0;
  for (const int v : {a, b})
    for (const int t : mesh.trianglesOf[v])
      volume += std::abs(doubleAreaVector(mesh, t).dot(position - mesh.positions[v])) / 6;
  return volume;
}

// The middle, or with keepRims an end that changes the volume clearly less, if one does: a rim that goes to the middle
// between itself and a flank wears away.
static Vector3d collapsePosition(const Remeshing& r, int a, int b) {
  const Vector3d &p = r.mesh.positions[a], &q = r.mesh.positions[b];
  Vector3d middle = projectToSurface(r.sdf, 0.5 * (p + q), 0.5 * (p - q).norm());
  if (!r.settings.keepRims) return middle;
  const double atP = sweptVolume(r.mesh, a, b, p), atQ = sweptVolume(r.mesh, a, b, q);
  if (sweptVolume(r.mesh, a, b, middle) < 1.2 * std::min(atP, atQ)) return middle;
  return atP < atQ ? p : q;
}

static bool collapse(Remeshing& r, int a, int b, double maxRatio) {
  const EdgeSides sides = sidesOf(r.mesh, a, b);
  if (!sides.valid || !mayCollapse(r.mesh, sides, a, b)) return false;
  if (valence(r.mesh, a) + valence(r.mesh, b) > 14) return false;  // the merged vertex would have more than ten
  const Vector3d position = collapsePosition(r, a, b);
  if (!collapseIsGood(r, sides, a, b, position, maxRatio)) return false;
  const double length = wantedLength(r, a, b);
  if (r.settings.keepRims && sweptVolume(r.mesh, a, b, position) > 0.2 * length * length * length) return false;
  collapseEdge(r.mesh, sides, a, b, position);
  r.relativeLength[b] = std::min(r.relativeLength[a], r.relativeLength[b]);
  r.onRim[b] = r.onRim[a] || r.onRim[b];
  return true;
}

static void splitLongEdges(Remeshing& r) {
  for (const auto& [a, b] : edgesOf(r.mesh))
    if (edgeRatio(r, a, b) > 4.0 / 3) split(r, a, b);
}

static void collapseShortEdges(Remeshing& r) {
  for (const auto& [a, b] : edgesOf(r.mesh)) {
    if (r.mesh.trianglesOf[a].empty() || r.mesh.trianglesOf[b].empty()) continue;
    if (edgeRatio(r, a, b) < 0.76) collapse(r, a, b, 1.4);
  }
}

// Flips where the worse of the two triangles gains, or where valences come nearer to six at little loss.
static bool flipIsGood(const Remeshing& r, const EdgeSides& sides, int a, int b) {
  const EditableMesh& mesh = r.mesh;
  const int c = sides.opposite[0], d = sides.opposite[1];
  const auto& x = mesh.positions;
  const Vector3d normal0 = doubleAreaVector(mesh, sides.triangle[0]).normalized();
  const Vector3d normal1 = doubleAreaVector(mesh, sides.triangle[1]).normalized();
  const Vector3d mean = (normal0 + normal1).normalized();
  const Vector3d after0 = (x[d] - x[c]).cross(x[b] - x[c]), after1 = (x[c] - x[d]).cross(x[a] - x[d]);
  if (normal0.dot(normal1) < 0.5 || after0.dot(mean) < 0.7 * after0.norm() || after1.dot(mean) < 0.7 * after1.norm())
    return false;
  const double before = std::min(quality(mesh, sides.triangle[0]), quality(mesh, sides.triangle[1]));
  const double after = std::min(triangleQuality(x[c], x[d], x[b]), triangleQuality(x[d], x[c], x[a]));
  const auto irregularity = [&](int change) {
    double sum = 0;
    for (const int v : {a, b}) sum += (valence(mesh, v) - change - 6) * (valence(mesh, v) - change - 6);
    for (const int v : {c, d}) sum += (valence(mesh, v) + change - 6) * (valence(mesh, v) + change - 6);
    return sum;
  };
  return after > before + 0.03 || (irregularity(1) < irregularity(0) && after > 0.75 * before && after > 0.45);
}

static void flipEdges(Remeshing& r) {
  for (const auto& [a, b] : edgesOf(r.mesh)) {
    const EdgeSides sides = sidesOf(r.mesh, a, b);
    if (sides.valid && mayFlip(r.mesh, sides, a, b) && flipIsGood(r, sides, a, b)) flipEdge(r.mesh, sides, a, b);
  }
}

static double worstQualityAround(const EditableMesh& mesh, int vertex) {
  double worst = 1;
  for (const int t : mesh.trianglesOf[vertex]) worst = std::min(worst, quality(mesh, t));
  return worst;
}

// Moves a vertex and keeps it there unless a triangle turned over or a bad one got worse.
static void tryMove(EditableMesh& mesh, int vertex, const Vector3d& position) {
  const Vector3d old = mesh.positions[vertex];
  const double worstBefore = worstQualityAround(mesh, vertex);
  std::vector<Vector3d> before;
  for (const int t : mesh.trianglesOf[vertex]) before.push_back(doubleAreaVector(mesh, t));
  mesh.positions[vertex] = position;
  const double worstAfter = worstQualityAround(mesh, vertex);
  bool good = worstAfter >= std::min(0.5, worstBefore);
  for (std::size_t k = 0; k < before.size(); ++k) {
    const Vector3d after = doubleAreaVector(mesh, mesh.trianglesOf[vertex][k]);
    good = good && after.dot(before[k]) > 0.6 * after.norm() * before[k].norm();
  }
  if (!good) mesh.positions[vertex] = old;
}

static Vector3d meanNormal(const EditableMesh& mesh, int vertex) {
  Vector3d sum = Vector3d::Zero();
  for (const int t : mesh.trianglesOf[vertex]) sum += doubleAreaVector(mesh, t);
  return sum.normalized();
}

// To the surface along the mesh's own normal, which points out of a rim where the triangles of both flanks meet: the
// nearest surface point would lie on one flank and leave the rim jagged.
static Vector3d projectToCrest(const SignedDistance& sdf, Vector3d p, const Vector3d& direction, double reach) {
  for (int i = 0; i < 4; ++i) {
    const double step = sdf(p) / std::max(gradient(sdf, p).dot(direction), 0.3);
    p -= direction * std::clamp(step, -reach, reach);
  }
  return p;
}

// Each vertex goes towards the centroid of its triangles, weighted so that small wanted sizes attract (a centroidal
// Voronoi step with density 1/L^3), along the surface only.
static void smooth(Remeshing& r, double weight) {
  EditableMesh& mesh = r.mesh;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (mesh.trianglesOf[v].empty()) continue;
    Vector3d sum = Vector3d::Zero();
    double total = 0;
    for (const int t : mesh.trianglesOf[v]) {
      const auto& q = mesh.triangles[t];
      const double relative = (r.relativeLength[q[0]] + r.relativeLength[q[1]] + r.relativeLength[q[2]]) / 3;
      const double mass = doubleAreaVector(mesh, t).norm() / (relative * relative * relative);
      sum += mass * (mesh.positions[q[0]] + mesh.positions[q[1]] + mesh.positions[q[2]]) / 3;
      total += mass;
    }
    const Vector3d normal = r.onRim[v] ? meanNormal(mesh, static_cast<int>(v)) : normalAt(r.sdf, mesh.positions[v]);
    Vector3d move = sum / total - mesh.positions[v];
    move -= normal * normal.dot(move);
    const double reach = 0.5 * r.edgeLength * r.relativeLength[v];
    const Vector3d wanted = mesh.positions[v] + weight * move;
    tryMove(mesh, static_cast<int>(v),
            r.onRim[v] ? projectToCrest(r.sdf, wanted, normal, reach) : projectToSurface(r.sdf, wanted, reach));
  }
}

// Single splits of the longest or collapses of the shortest edges until the count is exact.
static void reachExactCount(Remeshing& r) {
  for (int round = 0; round < 200; ++round) {
    const int excess = triangleCount(r.mesh) - r.settings.triangles;
    if (excess == 0) return;
    std::vector<std::array<int, 2>> edges = edgesOf(r.mesh);
    const double sign = excess > 0 ? 1 : -1;
    std::stable_sort(edges.begin(), edges.end(), [&](const auto& e, const auto& f) {
      return sign * edgeRatio(r, e[0], e[1]) < sign * edgeRatio(r, f[0], f[1]);
    });
    int budget = std::max(1, std::abs(excess) / 8);
    for (const auto& [a, b] : edges) {
      if (budget == 0) break;
      if (excess > 0 ? collapse(r, a, b, 2.2) : split(r, a, b)) --budget;
    }
    flipEdges(r);
    smooth(r, 0.5);
  }
  throw std::runtime_error(
      "remeshing cannot reach the wanted number of triangles: expected an even number that the shape can carry");
}

TriangleMesh remesh(const TriangleMesh& start, const SignedDistance& sdf, const RemeshSettings& settings) {
  Remeshing r{sdf, settings, makeEditable(start), {}, {}, 2};
  updateRelativeLengths(r);
  r.edgeLength = edgeLengthForCount(r);
  const int rounds = 12;
  for (int round = 0; round < rounds; ++round) {
    updateRelativeLengths(r);
    r.edgeLength = edgeLengthForCount(r);
    splitLongEdges(r);
    for (int pass = 0; pass < (round == 0 ? 4 : 1); ++pass) collapseShortEdges(r);
    for (int pass = 0; pass < 2; ++pass) flipEdges(r);
    for (int pass = 0; pass < 3; ++pass) smooth(r, 0.6);
  }
  updateRelativeLengths(r);
  reachExactCount(r);
  for (int pass = 0; pass < 30; ++pass) {
    flipEdges(r);
    smooth(r, 0.5);
  }
  return withoutGaps(r.mesh);
}

}  // namespace medulla
