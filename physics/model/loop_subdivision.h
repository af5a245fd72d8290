#pragma once

#include <array>
#include <utility>
#include <vector>

namespace medulla {

// A row of weights over the vertices of the control mesh: vertex and weight, ascending.
using Stencil = std::vector<std::pair<int, double>>;

// A subdivided mesh whose vertices are given by stencils over the control mesh.
struct SubdivisionLevel {
  std::vector<Stencil> stencils;
  std::vector<std::array<int, 3>> triangles;
};

SubdivisionLevel controlLevel(int vertices, const std::vector<std::array<int, 3>>& triangles);

// One step of Loop's scheme on a closed manifold mesh (Loop 1987): old vertices first, then one per edge.
SubdivisionLevel subdivideLoop(const SubdivisionLevel& level);

// Limit position and two limit tangents of every vertex (Loop 1987; Biermann, Levin and Zorin 2000), over the control
// mesh. tangent0 x tangent1 points to the side from which the triangles are counter-clockwise.
struct LimitStencils {
  std::vector<Stencil> position, tangent0, tangent1;
};
LimitStencils limitStencils(const SubdivisionLevel& level);

}  // namespace medulla
