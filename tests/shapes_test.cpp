// The committed meshes: what the model, the scenes and the README promise of them.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "physics/model/self_intersection.h"
#include "physics/model/surface_queries.h"
#include "physics/model/triangle_mesh.h"
#include "tests/temporary_folder.h"

namespace medulla {

using Eigen::Vector3d;

// A reader of its own: the program's reader must not be able to hide a fault of the file.
static TriangleMesh readObj(const std::string& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  TriangleMesh mesh;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string tag;
    words >> tag;
    if (tag == "v") {
      Vector3d& v = mesh.vertices.emplace_back();
      words >> v.x() >> v.y() >> v.z();
    } else if (tag == "f") {
      auto& t = mesh.triangles.emplace_back();
      words >> t[0] >> t[1] >> t[2];
      for (int& corner : t) --corner;
    }
    EXPECT_TRUE(words) << path << ": " << line;
  }
  return mesh;
}

static std::string asset(const std::string& name) {
  return std::string(MEDULLA_SOURCE_DIR) + "/assets/" + name;
}

static void expectClosedManifoldBall(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> halfEdges;
  std::vector<std::map<int, int>> nextAround(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      ++halfEdges[{t[k], t[(k + 1) % 3]}];
      nextAround[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
    }
  }
  for (const auto& [edge, count] : halfEdges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(halfEdges.count({edge.second, edge.first})) << "open edge at vertex " << edge.first;
  }
  // One fan per vertex: from any neighbour the walk visits every neighbour.
  for (const auto& around : nextAround) {
    ASSERT_FALSE(around.empty());
    std::set<int> visited;
    int neighbour = around.begin()->first;
    while (visited.insert(neighbour).second) neighbour = around.at(neighbour);
    EXPECT_EQ(visited.size(), around.size());
  }
  // Connected, so that Euler's characteristic 2 means genus 0.
  std::vector<bool> reached(mesh.vertices.size(), false);
  std::vector<int> open = {0};
  reached[0] = true;
  while (!open.empty()) {
    const int v = open.back();
    open.pop_back();
    for (const auto& [neighbour, unused] : nextAround[v]) {
      if (reached[neighbour]) continue;
      reached[neighbour] = true;
      open.push_back(neighbour);
    }
  }
  EXPECT_TRUE(std::all_of(reached.begin(), reached.end(), [](bool r) { return r; }));
  EXPECT_EQ(std::ssize(mesh.vertices) - std::ssize(halfEdges) / 2 + std::ssize(mesh.triangles), 2);
}

// 2 x inradius / circumradius of every triangle, ascending.
static std::vector<double> qualities(const TriangleMesh& mesh) {
  std::vector<double> result;
  for (const auto& t : mesh.triangles) {
    const double a = (mesh.vertices[t[1]] - mesh.vertices[t[2]]).norm();
    const double b = (mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm();
    const double c = (mesh.vertices[t[0]] - mesh.vertices[t[1]]).norm();
    result.push_back((b + c - a) * (c + a - b) * (a + b - c) / (a * b * c));
  }
  std::sort(result.begin(), result.end());
  return result;
}

static double signedVolume(const TriangleMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles)
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  return volume;
}

static double length(const TriangleMesh& mesh) {
  double largest = 0;
  for (const Vector3d& p : mesh.vertices)
    for (const Vector3d& q : mesh.vertices) largest = std::max(largest, (p - q).norm());
  return largest;
}

TEST(Shapes, GallbladderHasThePapersTriangleCountAndIsWellShaped) {
  const TriangleMesh mesh = readObj(asset("gallbladder/gallbladder.obj"));
  EXPECT_EQ(mesh.triangles.size(), 466U);
  expectClosedManifoldBall(mesh);
  EXPECT_NEAR(length(mesh), 0.09, 0.005);
  EXPECT_NEAR(signedVolume(mesh), 40e-6, 5e-6);  // m3: a normal filling is 30 to 50 ml
  const std::vector<double> quality = qualities(mesh);
  EXPECT_GT(quality.front(), 0.5);
  EXPECT_GT(quality[quality.size() / 2], 0.95);
}

TEST(Shapes, FineGallbladderIsTheSameShape) {
  const TriangleMesh coarse = readObj(asset("gallbladder/gallbladder.obj"));
  const TriangleMesh fine = readObj(asset("gallbladder/gallbladder_fine.obj"));
  expectClosedManifoldBall(fine);
  EXPECT_GE(fine.triangles.size(), 15000U);
  // Both have their vertices on one surface, where the fine one's stand less than a millimetre apart.
  for (const Vector3d& p : coarse.vertices) {
    double nearest = 1;
    for (const Vector3d& q : fine.vertices) nearest = std::min(nearest, (p - q).norm());
    EXPECT_LT(nearest, 0.001);
  }
}

struct CommittedMesh {
  std::string name;
  std::size_t triangles;
};

static const std::vector<CommittedMesh> committedMeshes = {{"gallbladder/gallbladder", 466},
                                                           {"gallbladder/gallbladder_fine", 20000},
                                                           {"liver/liver", 2000},
                                                           {"liver/liver_fine", 24000},
                                                           {"stomach/stomach", 1500},
                                                           {"stomach/stomach_fine", 16000},
                                                           {"gut/colon", 3200},
                                                           {"gut/colon_fine", 24000},
                                                           {"gut/small_intestine", 2800},
                                                           {"gut/small_intestine_fine", 20000},
                                                           {"dolphin/dolphin", 1120},
                                                           {"dolphin/dolphin_fine", 16000},
                                                           {"toys/bean", 200},
                                                           {"toys/drop", 160},
                                                           {"toys/star", 240},
                                                           {"toys/bowl", 4000},
                                                           {"toys/bowl_fine", 26000},
                                                           {"scenery/fat", 18000},
                                                           {"scenery/wall", 4000}};

TEST(Shapes, EveryMeshIsABallOfGoodTrianglesThatDoesNotCrossItself) {
  for (const CommittedMesh& committed : committedMeshes) {
    SCOPED_TRACE(committed.name);
    const TriangleMesh mesh = readObj(asset(committed.name + ".obj"));
    EXPECT_EQ(mesh.triangles.size(), committed.triangles);
    expectClosedManifoldBall(mesh);
    const std::vector<double> quality = qualities(mesh);
    EXPECT_GE(quality.front(), 0.5);
    EXPECT_GE(quality[quality.size() / 2], 0.95);
    EXPECT_TRUE(findSelfIntersections(mesh).empty());
    EXPECT_EQ(signedVolume(mesh) < 0, committed.name == "scenery/wall");  // seen from inside
  }
}

// Nothing else stands in assets that the list above would miss.
TEST(Shapes, EveryMeshFileIsListed) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(asset("")))
    files += entry.path().extension() == ".obj";
  EXPECT_EQ(files, committedMeshes.size());
}

static std::vector<std::string> organs(const std::string& suffix) {
  std::vector<std::string> names = {"gallbladder/gallbladder", "liver/liver", "stomach/stomach", "gut/colon",
                                    "gut/small_intestine"};
  for (std::string& name : names) name += suffix + ".obj";
  return names;
}

// Smallest distance of a vertex of one from the surface of the other; 0 where one lies inside.
static double gapBetween(const TriangleMesh& first, const TriangleMesh& second) {
  double gap = 0.05;
  for (const auto& [points, surface] : {std::pair(&first, &second), std::pair(&second, &first)}) {
    const SurfaceTree tree = makeSurfaceTree(*surface);
    for (const Vector3d& p : points->vertices) {
      gap = std::min(gap, closestPoint(tree, p, gap).distance);
      if (closestPoint(tree, p, 0.01).distance < 0.01 && isInside(tree, p)) return 0;
    }
  }
  return gap;
}

TEST(Shapes, OrgansLieCloseAndDoNotCross) {
  for (const std::string suffix : {"", "_fine"}) {
    std::vector<TriangleMesh> meshes;
    for (const std::string& name : organs(suffix)) meshes.push_back(readObj(asset(name)));
    std::map<std::pair<std::size_t, std::size_t>, double> gaps;
    TriangleMesh all;
    for (std::size_t i = 0; i < meshes.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        gaps[{j, i}] = gapBetween(meshes[j], meshes[i]);
        EXPECT_GE(gaps.at({j, i}), 0.3e-3) << organs(suffix)[j] << " and " << organs(suffix)[i];
      }
      const int offset = static_cast<int>(all.vertices.size());
      all.vertices.insert(all.vertices.end(), meshes[i].vertices.begin(), meshes[i].vertices.end());
      for (const auto& t : meshes[i].triangles) all.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    }
    EXPECT_TRUE(findSelfIntersections(all).empty());
    const std::vector<std::pair<std::size_t, std::size_t>> neighbours = {{0, 1}, {1, 2}, {2, 3}, {3, 4}};
    for (const auto& pair : neighbours) EXPECT_LT(gaps.at(pair), 4e-3) << organs(suffix)[pair.first];
  }
}

TEST(Shapes, AbdominalWallEnclosesEveryOrgan) {
  const TriangleMesh wall = readObj(asset("scenery/wall.obj"));
  const SurfaceTree tree = makeSurfaceTree(wall);
  for (const std::string& name : organs("")) {
    double gap = 1;
    for (const Vector3d& p : readObj(asset(name)).vertices) {
      gap = std::min(gap, closestPoint(tree, p, 1).distance);
      EXPECT_TRUE(isInside(tree, p)) << name << " at " << p.transpose();
    }
    EXPECT_GE(gap, 10e-3) << name;
  }
}

TEST(Shapes, ProgramRepeatsTheCommittedMeshesToTheByte) {
  const TemporaryFolder folder;
  std::string command = "\"" MEDULLA_SHAPES "\" -o \"";
  command += folder.path();
  command += "\" gallbladder dolphin > /dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto bytes = [](const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  for (const std::string name : {"gallbladder/gallbladder.obj", "dolphin/dolphin.obj"})
    EXPECT_EQ(bytes(folder / name), bytes(asset(name))) << name;
}

}  // namespace medulla
