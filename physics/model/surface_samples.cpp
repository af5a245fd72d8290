#include "physics/model/surface_samples.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace medulla {

double RandomSequence::uniform() {
  std::uint64_t z = (state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

Eigen::Vector3d RandomSequence::normal() {
  Eigen::Vector3d sum = Eigen::Vector3d::Constant(-6);
  for (int k = 0; k < 12; ++k)
    for (int a = 0; a < 3; ++a) sum[a] += uniform();
  return sum;
}

std::vector<SurfaceSample> sampleSurface(const TriangleMesh& mesh, int count, std::uint64_t seed) {
  std::vector<double> areaUpTo;
  areaUpTo.reserve(mesh.triangles.size());
  double area = 0;
  const auto corner = [&](int t, int c) -> const Eigen::Vector3d& { return mesh.vertices[mesh.triangles[t][c]]; };
  const auto cross = [&](int t) -> Eigen::Vector3d {
    return (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0));
  };
  const int triangles = static_cast<int>(mesh.triangles.size());
  for (int t = 0; t < triangles; ++t) areaUpTo.push_back(area += cross(t).norm() / 2);

  RandomSequence random{seed};
  std::vector<SurfaceSample> samples;
  samples.reserve(count);
  for (int i = 0; i < count; ++i) {
    const double at = (i + random.uniform()) / count * area;
    const auto found = std::lower_bound(areaUpTo.begin(), areaUpTo.end(), at);
    const int t = std::min(static_cast<int>(found - areaUpTo.begin()), triangles - 1);
    double a = random.uniform(), b = random.uniform();
    if (a + b > 1) {
      a = 1 - a;
      b = 1 - b;
    }
    samples.push_back(
        {corner(t, 0) + a * (corner(t, 1) - corner(t, 0)) + b * (corner(t, 2) - corner(t, 0)), cross(t).normalized()});
  }
  return samples;
}

std::vector<Eigen::Vector3d> gapPoints(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> points = mesh.vertices;
  for (const SurfaceSample& s : sampleSurface(mesh, 12000, 99)) points.push_back(s.point);
  return points;
}

}  // namespace medulla
