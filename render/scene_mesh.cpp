#include "render/scene_mesh.h"

#include <algorithm>
#include <cmath>

namespace medulla {
namespace {

glm::vec3 normalizedOr(glm::vec3 v, glm::vec3 fallback) {
  const float length = glm::length(v);
  return length > 1e-20f ? v / length : fallback;
}

}  // namespace

void SceneMesh::resizeVertices(std::size_t count) {
  position.resize(count);
  normal.resize(count);
  tangent.resize(count);
  uv.resize(count);
  albedo.resize(count);
  openness.resize(count, 1.f);
  blanch.resize(count, 0.f);
}

void computeNormals(SceneMesh& mesh, const MeshPart& part) {
  const auto first = mesh.normal.begin() + part.firstVertex, last = first + part.vertexCount;
  std::fill(first, last, glm::vec3(0));
  for (std::uint32_t k = part.firstIndex; k < part.firstIndex + part.indexCount; k += 3) {
    const std::uint32_t a = mesh.index[k], b = mesh.index[k + 1], c = mesh.index[k + 2];
    const glm::vec3 n = glm::cross(mesh.position[b] - mesh.position[a], mesh.position[c] - mesh.position[a]);
    mesh.normal[a] += n;
    mesh.normal[b] += n;
    mesh.normal[c] += n;
  }
  for (auto n = first; n != last; ++n) *n = normalizedOr(*n, {0, 0, 1});
}

void computeTangents(SceneMesh& mesh, const MeshPart& part) {
  std::fill_n(mesh.tangent.begin() + part.firstVertex, part.vertexCount, glm::vec3(0));
  for (std::uint32_t k = part.firstIndex; k < part.firstIndex + part.indexCount; k += 3) {
    const std::uint32_t a = mesh.index[k], b = mesh.index[k + 1], c = mesh.index[k + 2];
    const glm::vec2 ub = mesh.uv[b] - mesh.uv[a], uc = mesh.uv[c] - mesh.uv[a];
    const float area = ub.x * uc.y - ub.y * uc.x;
    const glm::vec3 t = (mesh.position[b] - mesh.position[a]) * uc.y - (mesh.position[c] - mesh.position[a]) * ub.y;
    for (const std::uint32_t i : {a, b, c}) mesh.tangent[i] += area < 0 ? -t : t;
  }
  for (std::uint32_t i = part.firstVertex; i < part.firstVertex + part.vertexCount; ++i) {
    const glm::vec3 n = mesh.normal[i], t = mesh.tangent[i] - n * glm::dot(n, mesh.tangent[i]);
    const glm::vec3 aside = std::abs(n.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
    mesh.tangent[i] = normalizedOr(t, glm::normalize(aside - n * glm::dot(n, aside)));
  }
}

}  // namespace medulla
