#include "render/visible_triangles.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace medulla {
namespace {

// Front to back by the farthest vertex: the cavity's wall, which surrounds the camera, comes last.
std::vector<std::size_t> frontToBack(const SceneMesh& mesh, const std::vector<glm::vec3>& picture) {
  std::vector<float> farthest(mesh.parts.size(), 0.f);
  for (std::size_t p = 0; p < mesh.parts.size(); ++p) {
    const MeshPart& part = mesh.parts[p];
    for (std::uint32_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i)
      farthest[p] = std::max(farthest[p], picture[i].z);
  }
  std::vector<std::size_t> order(mesh.parts.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return farthest[a] < farthest[b]; });
  return order;
}

bool isVisible(glm::vec3 a, glm::vec3 b, glm::vec3 c, const Viewpoint& view) {
  if (a.z < kNearPlane && b.z < kNearPlane && c.z < kNearPlane) return false;
  if (a.z < kNearPlane || b.z < kNearPlane || c.z < kNearPlane) return true;  // OpenGL clips it
  if ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) <= 0) return false;
  const float x0 = std::min({a.x, b.x, c.x}), x1 = std::max({a.x, b.x, c.x});
  const float y0 = std::min({a.y, b.y, c.y}), y1 = std::max({a.y, b.y, c.y});
  const float halfWidth = 0.5f * view.aspect;
  if (x0 > halfWidth || x1 < -halfWidth || y0 > 0.5f || y1 < -0.5f) return false;
  const float x = std::max({0.f, x0, -x1}), y = std::max({0.f, y0, -y1});
  return !view.round || x * x + y * y < kRimOuter * kRimOuter;
}

}  // namespace

void findVisibleTriangles(const SceneMesh& mesh, const Viewpoint& view, VisibleTriangles& out) {
  out.picture.resize(mesh.position.size());
  for (std::size_t i = 0; i < out.picture.size(); ++i) out.picture[i] = pictureFromWorld(view, mesh.position[i]);
  out.placeOf.assign(mesh.position.size(), VisibleTriangles::kUnused);
  out.parts.clear();
  out.vertices.clear();
  out.index.clear();
  for (const std::size_t p : frontToBack(mesh, out.picture)) {
    const MeshPart& part = mesh.parts[p];
    VisiblePart seen{p, std::uint32_t(out.vertices.size()), 0, std::uint32_t(out.index.size()), 0};
    for (std::uint32_t k = part.firstIndex; k < part.firstIndex + part.indexCount; k += 3) {
      const std::uint32_t* t = &mesh.index[k];
      if (!isVisible(out.picture[t[0]], out.picture[t[1]], out.picture[t[2]], view)) continue;
      for (int c = 0; c < 3; ++c) {
        std::uint32_t& place = out.placeOf[t[c]];
        if (place == VisibleTriangles::kUnused) {
          place = std::uint32_t(out.vertices.size());
          out.vertices.push_back(t[c]);
        }
        out.index.push_back(place);
      }
    }
    seen.vertexCount = std::uint32_t(out.vertices.size()) - seen.firstVertex;
    seen.indexCount = std::uint32_t(out.index.size()) - seen.firstIndex;
    if (seen.indexCount > 0) out.parts.push_back(seen);
  }
}

}  // namespace medulla
