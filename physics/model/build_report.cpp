#include "physics/model/build_report.h"

#include <algorithm>
#include <cmath>

#include "physics/model/attachment.h"
#include "physics/model/link_graph.h"
#include "physics/model/link_sections.h"
#include "physics/model/mesh_topology.h"
#include "physics/model/node_volumes.h"

namespace medulla {

using Eigen::Vector3d;

double signedDistanceToCone(const Vector3d& p, const Ball& a, const Ball& b) {
  // In the half plane through the axis: the cone's flank is the common tangent of the two circles. The distance to the
  // nearest of the balls in between, at s in 0..1, is least where the line from p meets the axis at the tangent's
  // slant.
  const Vector3d axis = b.centre - a.centre;
  const double length = axis.norm(), shrink = a.radius - b.radius;
  if (length <= std::abs(shrink))  // one ball holds the other
    return std::min((p - a.centre).norm() - a.radius, (p - b.centre).norm() - b.radius);
  const double along = (p - a.centre).dot(axis) / length;
  const double across = std::sqrt(std::max(0., (p - a.centre).squaredNorm() - along * along));
  const double slant = shrink / std::sqrt(length * length - shrink * shrink);
  const double s = std::clamp((along - across * slant) / length, 0., 1.);
  return (p - a.centre - s * axis).norm() - (a.radius - s * shrink);
}

namespace {

double distanceToCones(const Vector3d& p, const std::vector<Ball>& balls, const std::vector<ElasticLink>& links) {
  double least = std::numeric_limits<double>::infinity();
  for (const ElasticLink& link : links)
    least = std::min(least, signedDistanceToCone(p, balls[link.sphere0], balls[link.sphere1]));
  return least;
}

void measureGaps(const SoftBodyModel& model, const TriangleMesh& mesh, const std::vector<Ball>& balls, double diagonal,
                 BuildReport& report) {
  const std::vector<Vector3d> points = gapPoints(mesh);
  double sum = 0;
  for (const Vector3d& p : points) {
    const double gap = std::max(0., distanceToBalls(p, balls));
    sum += gap;
    report.gapMax = std::max(report.gapMax, gap / diagonal * 100);
    if (gap / diagonal * 100 <= report.gapConesMax) continue;
    const double gapCones = std::max(0., std::min(gap, distanceToCones(p, balls, model.links)));
    report.gapConesMax = std::max(report.gapConesMax, gapCones / diagonal * 100);
  }
  report.gapMean = sum / static_cast<double>(points.size()) / diagonal * 100;
}

void measureCover(const SoftBodyModel& model, const std::vector<Ball>& balls, const VoxelBody& voxels,
                  BuildReport& report) {
  double total = 0, inBalls = 0, inCones = 0;
  for (const VoxelPiece& piece : voxels.pieces) {
    total += piece.volume;
    if (distanceToBalls(piece.centre, balls) <= 0) {
      inBalls += piece.volume;
      inCones += piece.volume;
    } else if (distanceToCones(piece.centre, balls, model.links) <= 0) {
      inCones += piece.volume;
    }
  }
  report.cover = inBalls / total * 100;
  report.coverCones = inCones / total * 100;
}

void measureMasses(const SoftBodyModel& model, const MassProperties& exact, double diagonal, BuildReport& report) {
  const std::vector<MassProperties> remaining = remainingSpheres(model.restNodes, model.spheres, model.attachments);
  const MassProperties total = totalOf(remaining, model.restNodes, model.attachments);
  report.massError = std::abs(total.volume / exact.volume - 1) * 100;
  report.centreError = (total.centroid - exact.centroid).norm() / diagonal * 100;
  const Eigen::Matrix3d expected = inertia(exact.secondMoment);
  report.inertiaError = (inertia(total.secondMoment) - expected).norm() / expected.norm() * 100;
}

// Where hollows are smoothed out, the drawn surface lies outside, which nobody takes for air.
void measureDrawnSurface(const SoftBodyModel& model, const TriangleMesh& mesh, double diagonal, BuildReport& report) {
  TriangleMesh drawn{{}, model.renderSurface.triangles};
  if (drawn.triangles.empty()) return;
  for (const auto& [x, y, z] : model.renderSurface.restPosition) drawn.vertices.emplace_back(x, y, z);
  const SurfaceTree tree = makeSurfaceTree(drawn);
  for (const Vector3d& p : gapPoints(mesh)) {
    const double distance = closestPoint(tree, p).distance / diagonal * 100;
    if (distance > report.drawnInsideMax && !isInside(tree, p)) report.drawnInsideMax = distance;
  }
}

void measureGraph(const SoftBodyModel& model, BuildReport& report) {
  SphereLinks links;
  for (const ElasticLink& link : model.links) links.push_back({link.sphere0, link.sphere1});
  report.components = countComponents(static_cast<int>(model.spheres.size()), links);
  const std::vector<int> counts = linkCounts(model.spheres.size(), model.links);
  report.degreeMax = *std::max_element(counts.begin(), counts.end());
  report.sheetLinks = countSheetLinks(model.spheres, model.links);
}

}  // namespace

BuildReport measureModel(const SoftBodyModel& model) {
  const TriangleMesh mesh{model.restNodes, model.triangles};
  const SurfaceTree tree = makeSurfaceTree(mesh);
  const MassProperties exact = massProperties(mesh);
  const VoxelBody voxels = voxelise(mesh, exact.volume, voxelsFor(static_cast<int>(model.spheres.size())));
  const double diagonal = boundsDiagonal(mesh);
  BuildReport report;
  report.volume = exact.volume;
  report.diagonal = diagonal;
  report.triangles = static_cast<int>(model.triangles.size());
  report.skeletonNodes = static_cast<int>(model.skeleton.nodes.size());
  report.skeletonLinks = static_cast<int>(model.skeleton.links.size());
  report.spheres = static_cast<int>(model.spheres.size());
  report.links = static_cast<int>(model.links.size());
  const std::vector<Ball> balls = ballsOf(model);
  measureGaps(model, mesh, balls, diagonal, report);
  measureCover(model, balls, voxels, report);
  measureMasses(model, exact, diagonal, report);
  measureGraph(model, report);
  measureDrawnSurface(model, mesh, diagonal, report);
  for (const FillingSphere& s : model.spheres) {
    const double sticksOut = s.radius - inscribedRadius(tree, s.restBallCentre);
    report.overshootMax = std::max(report.overshootMax, sticksOut / diagonal * 100);
    report.centresOutside += isInside(tree, s.restBallCentre) && isInside(tree, s.restFrame) ? 0 : 1;
  }
  report.attachmentsCrossing = countCrossings(mesh, tree, model.attachments, model.spheres, model.links);
  for (const Attachment& a : model.attachments)
    report.attachmentMax = std::max(report.attachmentMax, a.restOffset.norm() / diagonal * 100);
  return report;
}

}  // namespace medulla
