#include "physics/model/loop_subdivision.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <numbers>

#include "physics/model/mesh_topology.h"

namespace medulla {

using std::numbers::pi;

namespace {

void addScaled(const Stencil& stencil, double scale, Stencil& sum) {
  for (const auto& [vertex, weight] : stencil) sum.emplace_back(vertex, scale * weight);
}

// Ascending vertices, each once.
Stencil gathered(Stencil terms) {
  std::stable_sort(terms.begin(), terms.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  Stencil row;
  for (const auto& [vertex, weight] : terms)
    if (!row.empty() && row.back().first == vertex)
      row.back().second += weight;
    else
      row.emplace_back(vertex, weight);
  return row;
}

// Neighbours of every vertex, counter-clockwise, beginning with the lowest.
std::vector<std::vector<int>> orderedRings(std::size_t vertices, const std::vector<std::array<int, 3>>& triangles) {
  std::vector<std::map<int, int>> next(vertices);  // around a vertex: the neighbour after a neighbour
  for (const std::array<int, 3>& t : triangles)
    for (int k = 0; k < 3; ++k) next[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
  std::vector<std::vector<int>> rings(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    if (next[v].empty()) continue;
    const int start = next[v].begin()->first;
    int at = start;
    do {
      rings[v].push_back(at);
      at = next[v].at(at);
    } while (at != start && rings[v].size() < next[v].size());
  }
  return rings;
}

double vertexBeta(std::size_t valence) {
  const auto n = static_cast<double>(valence);
  const double c = 3. / 8 + std::cos(2 * pi / n) / 4;
  return (5. / 8 - c * c) / n;
}

}  // namespace

SubdivisionLevel controlLevel(int vertices, const std::vector<std::array<int, 3>>& triangles) {
  SubdivisionLevel level{{}, triangles};
  for (int v = 0; v < vertices; ++v) level.stencils.push_back({{v, 1.}});
  return level;
}

SubdivisionLevel subdivideLoop(const SubdivisionLevel& level) {
  const std::size_t vertices = level.stencils.size();
  SubdivisionLevel finer;
  finer.stencils.resize(vertices);
  const std::vector<std::vector<int>> rings = orderedRings(vertices, level.triangles);
  for (std::size_t v = 0; v < vertices; ++v) {
    const double beta = vertexBeta(std::max<std::size_t>(rings[v].size(), 3));
    Stencil terms;
    addScaled(level.stencils[v], 1 - static_cast<double>(rings[v].size()) * beta, terms);
    for (const int neighbour : rings[v]) addScaled(level.stencils[neighbour], beta, terms);
    finer.stencils[v] = gathered(std::move(terms));
  }

  // Edge vertices: 3/8 of the ends, 1/8 of the two opposite corners.
  std::map<std::array<int, 2>, std::pair<int, std::array<int, 2>>> edges;  // ends -> new vertex, opposite corners
  std::vector<std::array<int, 2>> order;
  for (const std::array<int, 3>& t : level.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::array<int, 2> ends = edgeOf(t[k], t[(k + 1) % 3]);
      const int opposite = t[(k + 2) % 3];
      const auto [entry, fresh] =
          edges.try_emplace(ends, static_cast<int>(vertices + order.size()), std::array<int, 2>{opposite, opposite});
      if (fresh)
        order.push_back(ends);
      else
        entry->second.second[1] = opposite;
    }
  }
  for (const std::array<int, 2>& ends : order) {
    const std::array<int, 2>& opposite = edges.at(ends).second;
    Stencil terms;
    for (const int end : ends) addScaled(level.stencils[end], 3. / 8, terms);
    for (const int corner : opposite) addScaled(level.stencils[corner], 1. / 8, terms);
    finer.stencils.push_back(gathered(std::move(terms)));
  }
  for (const std::array<int, 3>& t : level.triangles) {
    std::array<int, 3> middle;  // of the edge after corner k
    for (int k = 0; k < 3; ++k) middle[k] = edges.at(edgeOf(t[k], t[(k + 1) % 3])).first;
    for (int k = 0; k < 3; ++k) finer.triangles.push_back({t[k], middle[k], middle[(k + 2) % 3]});
    finer.triangles.push_back(middle);
  }
  return finer;
}

LimitStencils limitStencils(const SubdivisionLevel& level) {
  const std::size_t vertices = level.stencils.size();
  const std::vector<std::vector<int>> rings = orderedRings(vertices, level.triangles);
  LimitStencils limit;
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto valence = static_cast<double>(rings[v].size());
    assert(rings[v].size() >= 3);
    const double gamma = 1 / (valence + 3 / (8 * vertexBeta(rings[v].size())));
    Stencil position, tangent0, tangent1;
    addScaled(level.stencils[v], 1 - valence * gamma, position);
    for (std::size_t k = 0; k < rings[v].size(); ++k) {
      const Stencil& neighbour = level.stencils[rings[v][k]];
      const double angle = 2 * pi * static_cast<double>(k) / valence;
      addScaled(neighbour, gamma, position);
      addScaled(neighbour, std::cos(angle), tangent0);
      addScaled(neighbour, std::sin(angle), tangent1);
    }
    limit.position.push_back(gathered(std::move(position)));
    limit.tangent0.push_back(gathered(std::move(tangent0)));
    limit.tangent1.push_back(gathered(std::move(tangent1)));
  }
  return limit;
}

}  // namespace medulla
