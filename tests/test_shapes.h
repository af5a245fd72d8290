#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>
#include <string>

#include "physics/model/mesh_repair.h"

// Closed meshes with known answers, for tests of model building.
namespace medulla {

inline RepairedMesh asRepaired(TriangleMesh mesh) {
  RepairedMesh repaired;
  repaired.vertexOfInput.resize(mesh.vertices.size());
  std::iota(repaired.vertexOfInput.begin(), repaired.vertexOfInput.end(), 0);
  repaired.mesh = std::move(mesh);
  return repaired;
}

// A subdivided icosahedron scaled to the half axes: 20 * 4^levels triangles.
inline TriangleMesh ellipsoidMesh(int levels, const Eigen::Vector3d& halfAxes) {
  const double g = (1 + std::sqrt(5.)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [entry, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.size()));
      if (fresh) mesh.vertices.push_back((mesh.vertices[a].normalized() + mesh.vertices[b].normalized()).normalized());
      return entry->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (Eigen::Vector3d& v : mesh.vertices) v = v.normalized().cwiseProduct(halfAxes);
  return mesh;
}

// From the origin, of twelve triangles.
inline TriangleMesh boxMesh(const Eigen::Vector3d& size) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k) mesh.vertices.push_back(size.cwiseProduct(Eigen::Vector3d(k & 1, k >> 1 & 1, k >> 2)));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline TriangleMesh together(const TriangleMesh& one, const TriangleMesh& other) {
  TriangleMesh mesh = one;
  const int first = static_cast<int>(one.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  return mesh;
}

// The outer surface with the inner one, turned inside out, as a cavity.
inline TriangleMesh hollowed(const TriangleMesh& outer, const TriangleMesh& inner) {
  TriangleMesh turned = inner;
  for (std::array<int, 3>& t : turned.triangles) std::swap(t[1], t[2]);
  return together(outer, turned);
}

// Two blocks side by side, so far apart (m).
inline TriangleMesh blocksMesh(double gap) {
  TriangleMesh one = boxMesh({0.05, 0.01, 0.02}), other = one;
  for (Eigen::Vector3d& x : other.vertices) x.y() += 0.01 + gap;
  return together(one, other);
}

// A straight round tube along +x from 0 to `length` with flat ends.
inline TriangleMesh cylinderMesh(double length, double radius, int around, int along) {
  TriangleMesh mesh;
  for (int i = 0; i <= along; ++i) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * 3.14159265358979 * (k + 0.5 * (i % 2)) / around;
      mesh.vertices.emplace_back(length * i / along, radius * std::cos(angle), radius * std::sin(angle));
    }
  }
  const int start = static_cast<int>(mesh.vertices.size()), end = start + 1;
  mesh.vertices.emplace_back(0, 0, 0);
  mesh.vertices.emplace_back(length, 0, 0);
  const auto at = [&](int i, int k) { return i * around + (k + around) % around; };
  for (int k = 0; k < around; ++k) {
    for (int i = 0; i < along; ++i) {
      const int shift = i % 2;  // the next ring's corner between corners k and k + 1
      mesh.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + shift)});
      mesh.triangles.push_back({at(i + 1, k), at(i, k + 1 - shift), at(i + 1, k + 1)});
    }
    mesh.triangles.push_back({start, at(0, k + 1), at(0, k)});
    mesh.triangles.push_back({end, at(along, k), at(along, k + 1)});
  }
  return mesh;
}

// The `v` and `f` lines of an OBJ file of ours.
inline TriangleMesh assetMesh(const std::string& name) {
  std::ifstream file(MEDULLA_SOURCE_DIR "/assets/" + name);
  if (!file) throw std::runtime_error("missing asset " + name);
  TriangleMesh mesh;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      Eigen::Vector3d v;
      words >> v[0] >> v[1] >> v[2];
      mesh.vertices.push_back(v);
    } else if (kind == "f") {
      std::array<int, 3> t;
      for (int& corner : t) {
        std::string word;
        words >> word;
        corner = std::stoi(word) - 1;
      }
      mesh.triangles.push_back(t);
    }
  }
  return mesh;
}

}  // namespace medulla
