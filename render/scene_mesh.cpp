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
  detail.resize(count, 1.f);
  seam.resize(count, 0.f);
  albedo.resize(count);
  openness.resize(count, 1.f);
  thinness.resize(count, 0.f);
  area.resize(count, 0.f);
  hollow.resize(count, 0.f);
  blanch.resize(count, 0.f);
}

void computeNormals(SceneMesh& mesh, const MeshPart& part) {
  const std::uint32_t last = part.endVertex();
  std::vector<glm::vec3>& around = mesh.tangent;  // scratch: the tangents follow
  std::fill_n(mesh.normal.begin() + part.firstVertex, part.vertexCount, glm::vec3(0));
  std::fill_n(around.begin() + part.firstVertex, part.vertexCount, glm::vec3(0));
  for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3) {
    const std::uint32_t a = mesh.index[k], b = mesh.index[k + 1], c = mesh.index[k + 2];
    const glm::vec3 pa = mesh.position[a], pb = mesh.position[b], pc = mesh.position[c], sum = pa + pb + pc;
    const glm::vec3 n = glm::cross(pb - pa, pc - pa);
    mesh.normal[a] += n;
    mesh.normal[b] += n;
    mesh.normal[c] += n;
    around[a] += sum - 3.f * pa;
    around[b] += sum - 3.f * pb;
    around[c] += sum - 3.f * pc;
  }
  for (std::uint32_t i = part.firstVertex; i < last; ++i) {
    const glm::vec3 n = mesh.normal[i];
    mesh.area[i] = glm::length(n);
    mesh.normal[i] = normalizedOr(n, {0, 0, 1});
    // Six even triangles of edge e: twice their area is 5.2 e^2, and each neighbour counts twice.
    mesh.hollow[i] = glm::dot(mesh.normal[i], around[i]) * 0.19f / std::sqrt(std::max(mesh.area[i], 1e-16f));
  }
}

float spacingOf(const SceneMesh& mesh, std::size_t i) {
  return 0.44f * std::sqrt(mesh.area[i]);
}

// Where there is no relief to speak of, nobody sees which way it runs: tangents that turn with the texture from vertex
// to vertex would crumple the highlights between them.
static void computeEvenTangents(SceneMesh& mesh, const MeshPart& part) {
  for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i) {
    const glm::vec3 n = mesh.normal[i];
    mesh.tangent[i] = normalizedOr(glm::vec3(1, 0, 0) - n * n.x, {0, 1, 0});
  }
}

static bool hasRelief(const MeshPart& part) {
  constexpr float kNoRelief = 0.05f;
  return part.look->bump > kNoRelief;
}

void computeTangents(SceneMesh& mesh, const MeshPart& part) {
  if (!hasRelief(part)) return computeEvenTangents(mesh, part);
  std::fill_n(mesh.tangent.begin() + part.firstVertex, part.vertexCount, glm::vec3(0));
  for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3) {
    const std::uint32_t a = mesh.index[k], b = mesh.index[k + 1], c = mesh.index[k + 2];
    const glm::vec2 ub = mesh.uv[b] - mesh.uv[a], uc = mesh.uv[c] - mesh.uv[a];
    const float area = ub.x * uc.y - ub.y * uc.x;
    const glm::vec3 t = (mesh.position[b] - mesh.position[a]) * uc.y - (mesh.position[c] - mesh.position[a]) * ub.y;
    for (const std::uint32_t i : {a, b, c}) mesh.tangent[i] += area < 0 ? -t : t;
  }
  for (std::uint32_t i = part.firstVertex; i < part.endVertex(); ++i) {
    const glm::vec3 n = mesh.normal[i], t = mesh.tangent[i] - n * glm::dot(n, mesh.tangent[i]);
    const glm::vec3 aside = std::abs(n.x) < 0.9f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
    mesh.tangent[i] = normalizedOr(t, glm::normalize(aside - n * glm::dot(n, aside)));
  }
}

// Cosine of the angle between two vertices' tangents as seen along their mean normal: how far a ridge between them is
// bent does not count.
static float agreement(const SceneMesh& mesh, std::uint32_t a, std::uint32_t b) {
  const glm::vec3 n = normalizedOr(mesh.normal[a] + mesh.normal[b], mesh.normal[a]);
  const glm::vec3 ta = mesh.tangent[a] - n * glm::dot(n, mesh.tangent[a]);
  const glm::vec3 tb = mesh.tangent[b] - n * glm::dot(n, mesh.tangent[b]);
  return glm::dot(ta, tb) / std::max(glm::length(ta) * glm::length(tb), 1e-6f);
}

void findSeams(SceneMesh& mesh, const MeshPart& part) {
  constexpr float kAgreeing = 0.5f;  // 60 degrees
  std::fill_n(mesh.seam.begin() + part.firstVertex, part.vertexCount, 0.f);
  if (!hasRelief(part)) return;  // even tangents disagree in two points alone
  for (std::uint32_t k = part.firstIndex; k < part.endIndex(); k += 3)
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t a = mesh.index[k + corner], b = mesh.index[k + (corner + 1) % 3];
      if (agreement(mesh, a, b) < kAgreeing) mesh.seam[a] = mesh.seam[b] = 1;
    }
}

}  // namespace medulla
