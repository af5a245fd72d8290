// The committed meshes: what the model, the scenes and the README promise of them.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
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

namespace medulla {

using Eigen::Vector3d;

struct ObjMesh {
  std::vector<Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

// A reader of its own: the program's reader must not be able to hide a fault of the file.
static ObjMesh readObj(const std::string& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << path;
  ObjMesh mesh;
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

static void expectClosedManifoldBall(const ObjMesh& mesh) {
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
static std::vector<double> qualities(const ObjMesh& mesh) {
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

static double signedVolume(const ObjMesh& mesh) {
  double volume = 0;
  for (const auto& t : mesh.triangles)
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6;
  return volume;
}

static double length(const ObjMesh& mesh) {
  double largest = 0;
  for (const Vector3d& p : mesh.vertices)
    for (const Vector3d& q : mesh.vertices) largest = std::max(largest, (p - q).norm());
  return largest;
}

TEST(Shapes, GallbladderHasThePapersTriangleCountAndIsWellShaped) {
  const ObjMesh mesh = readObj(asset("gallbladder/gallbladder.obj"));
  EXPECT_EQ(mesh.triangles.size(), 466U);
  expectClosedManifoldBall(mesh);
  EXPECT_NEAR(length(mesh), 0.09, 0.005);
  EXPECT_NEAR(signedVolume(mesh), 40e-6, 5e-6);  // m3: a normal filling is 30 to 50 ml
  const std::vector<double> quality = qualities(mesh);
  EXPECT_GT(quality.front(), 0.5);
  EXPECT_GT(quality[quality.size() / 2], 0.95);
}

TEST(Shapes, FineGallbladderIsTheSameShape) {
  const ObjMesh coarse = readObj(asset("gallbladder/gallbladder.obj"));
  const ObjMesh fine = readObj(asset("gallbladder/gallbladder_fine.obj"));
  expectClosedManifoldBall(fine);
  EXPECT_GE(fine.triangles.size(), 15000U);
  // Both have their vertices on one surface, where the fine one's stand less than a millimetre apart.
  for (const Vector3d& p : coarse.vertices) {
    double nearest = 1;
    for (const Vector3d& q : fine.vertices) nearest = std::min(nearest, (p - q).norm());
    EXPECT_LT(nearest, 0.001);
  }
}

TEST(Shapes, SceneryIsClosedAndClearOfTheGallbladder) {
  const ObjMesh gallbladder = readObj(asset("gallbladder/gallbladder_fine.obj"));
  for (const std::string name : {"liver", "stomach", "fat"}) {
    const ObjMesh mesh = readObj(asset("scenery/" + name + ".obj"));
    expectClosedManifoldBall(mesh);
    EXPECT_GT(signedVolume(mesh), 0) << name;
    double nearest = 1;
    for (const Vector3d& p : mesh.vertices)
      for (const Vector3d& q : gallbladder.vertices) nearest = std::min(nearest, (p - q).squaredNorm());
    EXPECT_GT(nearest, 0.0004 * 0.0004) << name;
  }
}

TEST(Shapes, WallIsSeenFromInside) {
  const ObjMesh mesh = readObj(asset("scenery/wall.obj"));
  expectClosedManifoldBall(mesh);
  EXPECT_LT(signedVolume(mesh), 0);
}

TEST(Shapes, ProgramRepeatsTheCommittedMeshToTheByte) {
  const std::filesystem::path directory = std::filesystem::path(testing::TempDir()) / "medulla_shapes_test";
  std::string command = "\"" MEDULLA_SHAPES "\" -o \"";
  command += directory.string();
  command += "\" gallbladder > /dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto bytes = [](const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  EXPECT_EQ(bytes(directory / "gallbladder/gallbladder.obj"), bytes(asset("gallbladder/gallbladder.obj")));
  std::filesystem::remove_all(directory);
}

}  // namespace medulla
