#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "render/looks.h"

namespace medulla {

// Of vertices, and of triangles by the places of their corners in an index.
struct MeshRange {
  std::uint32_t firstVertex = 0, vertexCount = 0, firstIndex = 0, indexCount = 0;

  std::uint32_t endVertex() const { return firstVertex + vertexCount; }
  std::uint32_t endIndex() const { return firstIndex + indexCount; }
};

// A range of SceneMesh that shares a look.
struct MeshPart : MeshRange {
  const Look* look = nullptr;
  bool moving = false;   // drawn from given positions in this picture
  bool travels = false;  // SurfaceShape
  bool instrument = false;
  float longestEdge = 0;  // m, at rest
};

// Everything that is drawn with tissue shading, in one set of arrays: surfaces in the order they were added, then the
// instruments. Positions in m, world.
struct SceneMesh {
  std::vector<glm::vec3> position, normal;
  std::vector<glm::vec3> tangent;  // unit, along the texture's u; v runs along cross(normal, tangent)
  std::vector<glm::vec2> uv;       // of the detail texture, 1 per tile; baked at rest, so that it sticks to the tissue
  std::vector<float> detail;       // 0..1: share of that texture's colour, none where its coordinates distort it
  std::vector<float> seam;         // 1 where tangents of neighbours do not agree, as where the texture folds; at rest
  std::vector<glm::vec3> albedo;   // linear RGB, baked at rest
  std::vector<float> openness;     // 0..1: share of the cavity's light that arrives (ambient occlusion), baked at rest
  std::vector<float> thinness;     // 0..1: share of light that comes through from behind, baked at rest
  std::vector<float> area;         // m^2, six times that of the vertex: twice its triangles'
  std::vector<float> hollow;       // mean slope at which the surface rises around the vertex: > 0 in a fold
  std::vector<float> blanch;       // 0..1: blood pressed out by an instrument or by stretch; < 0: dammed up
  std::vector<std::uint32_t> index;
  std::vector<MeshPart> parts;

  void resizeVertices(std::size_t count);
};

// `visit(array)` of every array with a number per vertex, a pointer to member.
template <class Visit>
void visitVertexArrays(const Visit& visit) {
  for (const auto array : {&SceneMesh::position, &SceneMesh::normal, &SceneMesh::tangent, &SceneMesh::albedo})
    visit(array);
  visit(&SceneMesh::uv);
  for (const auto array : {&SceneMesh::detail, &SceneMesh::seam, &SceneMesh::openness, &SceneMesh::thinness,
                           &SceneMesh::area, &SceneMesh::hollow, &SceneMesh::blanch})
    visit(array);
}

// Area-weighted vertex normals (the sum of cross products) of one part, and what else its triangles tell: area, hollow.
void computeNormals(SceneMesh& mesh, const MeshPart& part);
// m, from vertex i to those beside it: six even triangles of edge e have, twice, 5.2 e^2.
float spacingOf(const SceneMesh& mesh, std::size_t i);
// Tangents from the gradient of u over each triangle, of looks without relief along x; needs normals.
void computeTangents(SceneMesh& mesh, const MeshPart& part);
void findSeams(SceneMesh& mesh, const MeshPart& part);  // of these

}  // namespace medulla
