#include "render/visible_triangles.h"

#include <algorithm>
#include <numeric>

namespace medulla {
namespace {

// Front to back by the farthest vertex: the cavity's wall, which surrounds the camera, comes last.
std::vector<std::size_t> frontToBack(const SceneMesh& mesh, const std::vector<glm::vec3>& picture) {
  std::vector<float> farthest(mesh.parts.size(), 0.f);
  for (std::size_t p = 0; p < mesh.parts.size(); ++p) {
    const MeshPart& part = mesh.parts[p];
    for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i)
      farthest[p] = std::max(farthest[p], picture[i].z);
  }
  std::vector<std::size_t> order(mesh.parts.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return farthest[a] < farthest[b]; });
  return order;
}

bool isVisible(glm::vec3 a, glm::vec3 b, glm::vec3 c, const Viewpoint& view) {
  if (a.z < view.nearPlane && b.z < view.nearPlane && c.z < view.nearPlane) return false;
  if (a.z < view.nearPlane || b.z < view.nearPlane || c.z < view.nearPlane) return true;  // OpenGL clips it
  if ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x) <= 0) return false;
  const float x0 = std::min({a.x, b.x, c.x}), x1 = std::max({a.x, b.x, c.x});
  const float y0 = std::min({a.y, b.y, c.y}), y1 = std::max({a.y, b.y, c.y});
  const float halfWidth = 0.5f * view.aspect;
  if (x0 > halfWidth || x1 < -halfWidth || y0 > 0.5f || y1 < -0.5f) return false;
  const float x = std::max({0.f, x0, -x1}), y = std::max({0.f, y0, -y1});
  return !view.round || x * x + y * y < view.rim * view.rim;
}

// Appends the corners, vertices of the mesh, of the part's triangles that face the camera within the picture.
void gatherFacing(const SceneMesh& mesh, const MeshPart& part, const Viewpoint& view, VisibleTriangles& out) {
  for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3) {
    const std::uint32_t* t = &mesh.index[k];
    if (isVisible(out.picture[t[0]], out.picture[t[1]], out.picture[t[2]], view))
      out.index.insert(out.index.end(), t, t + 3);
  }
}

void drawDepth(const Viewpoint& view, VisibleTriangles& out) {
  const auto width = float(out.nearest.width), height = float(out.nearest.height);
  out.texel.resize(out.picture.size());
  for (std::size_t i = 0; i < out.texel.size(); ++i) {
    const glm::vec3 p = out.picture[i];
    out.texel[i] = {(p.x / view.aspect + 0.5f) * width, (p.y + 0.5f) * height,
                    1 - view.nearPlane / std::max(p.z, view.nearPlane)};
  }
  out.nearest.clear();
  for (std::size_t k = 0; k < out.index.size(); k += 3) {
    const glm::vec3 a = out.texel[out.index[k]], b = out.texel[out.index[k + 1]], c = out.texel[out.index[k + 2]];
    if (std::min({a.z, b.z, c.z}) > 0) out.nearest.rasterize(a, b, c);
  }
}

// Is there something nearer wherever the triangle or a texel beside it could show?
bool isHidden(const VisibleTriangles& seen, const std::uint32_t* t) {
  constexpr float kMargin = 2.5f;  // texels: the map knows its texels' centres only
  // .8 mm of .2 m, if the camera looks at what is as far away: a fine surface must not hide itself.
  constexpr float kBias = 0.000012f;
  const glm::vec3 a = seen.texel[t[0]], b = seen.texel[t[1]], c = seen.texel[t[2]];
  const float right = float(seen.nearest.width - 1), bottom = float(seen.nearest.height - 1);
  const float z = std::min({a.z, b.z, c.z}) - kBias;
  if (z <= 0) return false;
  const int x0 = int(std::clamp(std::min({a.x, b.x, c.x}) - kMargin, 0.f, right)),
            x1 = int(std::clamp(std::max({a.x, b.x, c.x}) + kMargin, 0.f, right)),
            y0 = int(std::clamp(std::min({a.y, b.y, c.y}) - kMargin, 0.f, bottom)),
            y1 = int(std::clamp(std::max({a.y, b.y, c.y}) + kMargin, 0.f, bottom));
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x)
      if (seen.nearest.at(x, y) >= z) return false;
  return true;
}

// From first on: drops hidden triangles and turns the corners of the others into places in out.vertices.
void keepSeen(std::size_t first, std::size_t last, bool opaque, VisibleTriangles& out, std::size_t& kept) {
  for (std::size_t k = first; k < last; k += 3) {
    if (opaque && isHidden(out, &out.index[k])) continue;
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t vertex = out.index[k + c];
      std::uint32_t& place = out.placeOf[vertex];
      if (place == VisibleTriangles::kUnused) {
        place = std::uint32_t(out.vertices.size());
        out.vertices.push_back(vertex);
      }
      out.index[kept++] = place;
    }
  }
}

}  // namespace

// Texels of 1.4 by 1.4 pixels: what shows through a narrower crack may be missed.
VisibleTriangles::VisibleTriangles(int pictureWidth, int pictureHeight)
    : nearest((pictureWidth * 5 / 7 + 7) / 8 * 8, (pictureHeight * 5 / 7 + 7) / 8 * 8) {}

void findVisibleTriangles(const SceneMesh& mesh, const Viewpoint& view, bool opaque, VisibleTriangles& out) {
  out.picture.resize(mesh.position.size());
  for (std::size_t i = 0; i < out.picture.size(); ++i) out.picture[i] = pictureFromWorld(view, mesh.position[i]);
  out.placeOf.assign(mesh.position.size(), VisibleTriangles::kUnused);
  out.parts.clear();
  out.vertices.clear();
  out.index.clear();
  for (const std::size_t p : frontToBack(mesh, out.picture)) {
    const auto first = std::uint32_t(out.index.size());
    gatherFacing(mesh, mesh.parts[p], view, out);
    out.parts.push_back({{0, 0, first, std::uint32_t(out.index.size()) - first}, p});
  }
  if (opaque) drawDepth(view, out);
  std::size_t kept = 0;
  for (VisiblePart& part : out.parts) {
    const std::size_t first = part.firstIndex, last = part.endIndex();
    part.firstVertex = std::uint32_t(out.vertices.size());
    part.firstIndex = std::uint32_t(kept);
    keepSeen(first, last, opaque, out, kept);
    part.vertexCount = std::uint32_t(out.vertices.size()) - part.firstVertex;
    part.indexCount = std::uint32_t(kept) - part.firstIndex;
  }
  out.index.resize(kept);
}

}  // namespace medulla
