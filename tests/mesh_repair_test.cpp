#include "physics/model/mesh_repair.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "physics/model/mesh_topology.h"
#include "physics/model/self_intersection.h"
#include "tests/complaint.h"

namespace medulla {

// One test per row of defects that a mesh may come with. The body is a sphere of 8 * 4^n triangles, radius 0.1 m.
static TriangleMesh sphere(int subdivisions = 3, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero(),
                           double radius = 0.1) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    mesh.vertices.push_back(Eigen::Vector3d::Unit(axis));
    mesh.vertices.push_back(-Eigen::Vector3d::Unit(axis));
  }
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int s = 0; s < subdivisions; ++s) {
    std::map<std::array<int, 2>, int> middleOf;
    const auto middle = [&](int a, int b) {
      const auto [it, isNew] =
          middleOf.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(mesh.vertices.size()));
      if (isNew) mesh.vertices.emplace_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return it->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (auto& v : mesh.vertices) v = centre + radius * v;
  return mesh;
}

static TriangleMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back((i & 1) ? high.x() : low.x(), (i & 2) ? high.y() : low.y(),
                               (i & 4) ? high.z() : low.z());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

static TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const int offset = static_cast<int>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return a;
}

static void turnInsideOut(TriangleMesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

static std::string refusal(const TriangleMesh& mesh) {
  return complaintOf([&] { repairMesh(mesh); });
}

#define EXPECT_CONTAINS(text, part) EXPECT_NE(std::string(text).find(part), std::string::npos) << (text)

static void expectWhole(const RepairedMesh& repaired, const TriangleMesh& input) {
  for (const auto& sides : trianglesOnEdges(repaired.mesh)) EXPECT_EQ(sides, (std::array<int, 3>{2, 2, 2}));
  EXPECT_GT(enclosedVolume(repaired.mesh), 0);
  ASSERT_EQ(repaired.vertexOfInput.size(), input.vertices.size());
  for (std::size_t v = 0; v < input.vertices.size(); ++v) {
    const int to = repaired.vertexOfInput[v];
    ASSERT_LT(to, static_cast<int>(repaired.mesh.vertices.size()));
    if (to >= 0) {
      EXPECT_LT((repaired.mesh.vertices[to] - input.vertices[v]).norm(), 1e-4) << v;
    }
  }
}

TEST(MeshRepair, CleanMeshIsLeftAlone) {
  const TriangleMesh input = sphere();
  const RepairedMesh out = repairMesh(input);
  EXPECT_EQ(out.mesh.vertices, input.vertices);
  EXPECT_EQ(out.mesh.triangles, input.triangles);
  EXPECT_TRUE(out.notes.empty());
  for (std::size_t v = 0; v < input.vertices.size(); ++v) EXPECT_EQ(out.vertexOfInput[v], static_cast<int>(v));
}

TEST(MeshRepair, NotANumberAndInfinityAreRefused) {
  TriangleMesh mesh = sphere();
  mesh.vertices[17].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_CONTAINS(refusal(mesh), "vertex 17 is not finite");
  mesh.vertices[17].y() = std::numeric_limits<double>::infinity();
  EXPECT_CONTAINS(refusal(mesh), "vertex 17 is not finite");
}

TEST(MeshRepair, IndexOutOfRangeAndNoTrianglesAreRefused) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.triangles[3][1] = 8;
  EXPECT_CONTAINS(refusal(mesh), "triangle 3 refers to vertex 8, expected 0 to 7");
  mesh.triangles[3][1] = -1;
  EXPECT_CONTAINS(refusal(mesh), "triangle 3 refers to vertex -1");
  mesh.triangles.clear();
  EXPECT_CONTAINS(refusal(mesh), "no triangles");
}

TEST(MeshRepair, SizesOutsideTheRangeOfBodiesAreRefused) {
  TriangleMesh mesh = box({0, 0, 0}, {1e7, 1e7, 1e7});
  EXPECT_CONTAINS(refusal(mesh), "is the unit right?");
  mesh = box({0, 0, 0}, {1e-8, 1e-8, 1e-8});
  EXPECT_CONTAINS(refusal(mesh), "is the unit right?");
  mesh = box({9e4, 0, 0}, {9e4 + 1, 1, 1});
  EXPECT_CONTAINS(refusal(mesh), "lies 9e+04 m from the origin");
}

TEST(MeshRepair, TriangleSoupIsWelded) {
  const TriangleMesh whole = sphere();
  TriangleMesh soup;
  for (const auto& t : whole.triangles) {
    const int n = static_cast<int>(soup.vertices.size());
    // Single precision, as files of loose triangles have it.
    for (const int v : t) soup.vertices.emplace_back(whole.vertices[v].cast<float>().cast<double>());
    soup.vertices.back().x() += 1e-9;
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  const RepairedMesh out = repairMesh(soup);
  expectWhole(out, soup);
  EXPECT_EQ(out.mesh.vertices.size(), whole.vertices.size());
  EXPECT_EQ(out.mesh.triangles.size(), whole.triangles.size());
  ASSERT_EQ(out.notes.size(), 1u);
  EXPECT_EQ(out.notes[0], "welded 1278 duplicate vertices");
}

TEST(MeshRepair, WeldingIsRelativeToTheEdgesAndKeepsFineDetail) {
  // A fine sphere inside a coarse, large one: were the tolerance taken from the box, the fine one would collapse.
  TriangleMesh fine = sphere(3, {0, 0, 0}, 1e-4);
  turnInsideOut(fine);
  const TriangleMesh mesh = joined(sphere(2, {0, 0, 0}, 0.1), fine);
  EXPECT_EQ(repairMesh(mesh).mesh.vertices.size(), mesh.vertices.size());
}

TEST(MeshRepair, FarVertexIsRefusedAndNamed) {
  TriangleMesh mesh = sphere();
  mesh.vertices[42] = {30, 0, 0};
  EXPECT_CONTAINS(refusal(mesh), "vertex 42 at (30 0 0) m lies");
  mesh = sphere();
  mesh.vertices.emplace_back(0, -30, 0);  // even where no triangle uses it: the file is not what it seems
  EXPECT_CONTAINS(refusal(mesh), "vertex 258 at (0 -30 0) m lies");
  EXPECT_CONTAINS(refusal(mesh), "of the mesh; no triangle uses it");
}

TEST(MeshRepair, LongMeshedLimbIsNoFarVertex) {
  TriangleMesh mesh = sphere(4);
  for (auto& v : mesh.vertices) {
    if (v.x() > 0.05) v.x() += 40 * (v.x() - 0.05);
  }
  EXPECT_NO_THROW(repairMesh(mesh));
}

TEST(MeshRepair, DegenerateAndDuplicateTrianglesAreDropped) {
  TriangleMesh mesh = sphere();
  mesh.triangles.push_back({5, 5, 9});
  mesh.triangles.push_back(mesh.triangles[10]);
  mesh.triangles.push_back({mesh.triangles[20][1], mesh.triangles[20][0], mesh.triangles[20][2]});
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_EQ(out.mesh.triangles, sphere().triangles);
  EXPECT_EQ(out.notes, (std::vector<std::string>{"dropped 1 degenerate triangle", "dropped 2 duplicate triangles"}));
}

TEST(MeshRepair, FinsAreDropped) {
  TriangleMesh mesh = sphere();
  const auto base = mesh.triangles[100];
  const int tip = static_cast<int>(mesh.vertices.size());
  mesh.vertices.emplace_back(mesh.vertices[base[0]] * 1.2);
  mesh.vertices.emplace_back(mesh.vertices[base[0]] * 1.2 + Eigen::Vector3d(0, 0, 0.01));
  mesh.triangles.push_back({base[0], base[1], tip});  // a flap of two triangles
  mesh.triangles.push_back({base[1], tip, tip + 1});
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_EQ(out.mesh.triangles, sphere().triangles);
  EXPECT_EQ(out.vertexOfInput[tip], -1);
  EXPECT_EQ(out.notes, (std::vector<std::string>{"dropped 2 fin triangles", "dropped 2 unused vertices"}));
}

TEST(MeshRepair, AFlapAsLargeAsABodyIsNoFin) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  const int n = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0, 0, 0}, {0, 0, 1}, {-2, -2, 1}, {-2, -2, 0}});
  mesh.triangles.insert(mesh.triangles.end(), {{n, n + 1, n + 2}, {n, n + 2, n + 3}});
  EXPECT_CONTAINS(refusal(mesh), "non-manifold: 1 edge");
}

TEST(MeshRepair, TriangleWithoutAreaIsFlippedNotDropped) {
  // A corner in the middle of a box's edge, used on one side only; on the other a triangle without area closes the gap.
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(0.5, 0, 0);  // on the edge 0-1 of triangles {0, 3, 1} and {0, 1, 5}
  mesh.triangles[1] = {0, 3, 8};
  mesh.triangles.push_back({8, 3, 1});
  mesh.triangles.push_back({0, 8, 1});
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_EQ(out.mesh.triangles.size(), mesh.triangles.size());
  EXPECT_NEAR(enclosedVolume(out.mesh), 1, 1e-12);
  for (const auto& t : out.mesh.triangles) EXPECT_GT(areaVector(out.mesh, t).norm(), 0.1);
  EXPECT_EQ(out.notes, (std::vector<std::string>{"flipped 1 edge of triangles without area"}));
}

TEST(MeshRepair, CrackAtATJunctionIsClosed) {
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(0.05, 0, 0);
  mesh.vertices.emplace_back(0.01, 0, 0);
  // Both new corners on one side only: the crack between is a loop without area, longer than a small hole.
  mesh.triangles[1] = {0, 3, 9};
  mesh.triangles.push_back({9, 3, 8});
  mesh.triangles.push_back({8, 3, 1});
  EXPECT_CONTAINS(refusal(mesh), "the surface is open");
  mesh = sphere();
  const auto t = mesh.triangles[7];
  const int middle = static_cast<int>(mesh.vertices.size());
  mesh.vertices.emplace_back((mesh.vertices[t[0]] + mesh.vertices[t[1]]) / 2);
  mesh.triangles[7] = {t[0], middle, t[2]};
  mesh.triangles.push_back({middle, t[1], t[2]});
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  for (const auto& triangle : out.mesh.triangles) EXPECT_GT(areaVector(out.mesh, triangle).norm(), 1e-6);
}

TEST(MeshRepair, InvertedOrientationIsTurnedOutward) {
  TriangleMesh mesh = sphere();
  turnInsideOut(mesh);
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_DOUBLE_EQ(enclosedVolume(out.mesh), enclosedVolume(sphere()));
  EXPECT_EQ(out.notes, (std::vector<std::string>{"turned the surface inside out: it faced inward"}));
}

TEST(MeshRepair, MixedOrientationIsFlooded) {
  TriangleMesh mesh = sphere();
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_NEAR(enclosedVolume(out.mesh), enclosedVolume(sphere()), 1e-15);
  EXPECT_EQ(out.notes, (std::vector<std::string>{"turned 171 triangles to face as their neighbours do"}));
}

TEST(MeshRepair, OneSidedSurfaceIsRefused) {
  // A Moebius band of twelve quads.
  TriangleMesh mesh;
  constexpr int kQuads = 12;
  for (int i = 0; i < kQuads; ++i) {
    const double angle = 2 * std::numbers::pi * i / kQuads;
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d across = std::cos(angle / 2) * out + std::sin(angle / 2) * Eigen::Vector3d::UnitZ();
    mesh.vertices.emplace_back(out - 0.2 * across);
    mesh.vertices.emplace_back(out + 0.2 * across);
  }
  for (int i = 0; i < kQuads; ++i) {
    const bool last = i + 1 == kQuads;
    const int a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
    mesh.triangles.push_back({a, c, b});
    mesh.triangles.push_back({b, c, d});
  }
  EXPECT_CONTAINS(refusal(mesh), "only one side");
}

TEST(MeshRepair, SmallHoleIsFilled) {
  TriangleMesh mesh = sphere();
  // The triangles around one vertex: a loop of 6 edges.
  const int removed = mesh.triangles[200][0];
  std::erase_if(mesh.triangles, [&](const auto& t) { return t[0] == removed || t[1] == removed || t[2] == removed; });
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_NEAR(enclosedVolume(out.mesh), enclosedVolume(sphere()), 0.01 * enclosedVolume(sphere()));
  ASSERT_EQ(out.notes.size(), 2u);
  EXPECT_EQ(out.notes[0], "dropped 1 unused vertex");
  EXPECT_CONTAINS(out.notes[1], "filled a hole of ");
  EXPECT_CONTAINS(out.notes[1], "mm (6 edges)");
}

TEST(MeshRepair, HolesThatMeetInAVertexAreFilledApart) {
  TriangleMesh mesh = sphere(2);
  // Two triangles around one vertex that share no edge.
  const int pinch = 20;
  std::vector<int> around;
  for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
    if (std::count(mesh.triangles[t].begin(), mesh.triangles[t].end(), pinch)) around.push_back(t);
  }
  const auto adjacent = adjacentTriangles(mesh);
  int opposite = -1;
  for (const int t : around) {
    if (t != around[0] && std::count(adjacent[around[0]].begin(), adjacent[around[0]].end(), t) == 0) opposite = t;
  }
  ASSERT_GT(opposite, around[0]);
  mesh.triangles.erase(mesh.triangles.begin() + opposite);
  mesh.triangles.erase(mesh.triangles.begin() + around[0]);
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_EQ(out.mesh.vertices.size(), mesh.vertices.size());
  EXPECT_NEAR(enclosedVolume(out.mesh), enclosedVolume(sphere(2)), 1e-15);
  ASSERT_EQ(out.notes.size(), 1u);
  EXPECT_CONTAINS(out.notes[0], "filled 2 holes, the largest of ");
}

TEST(MeshRepair, LargeOpeningIsRefusedWithItsLength) {
  TriangleMesh mesh = box({0, 0, 0}, {0.1, 0.1, 0.1});
  mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 2);
  EXPECT_CONTAINS(refusal(mesh), "the surface is open: an opening of 400 mm (4 edges)");
  EXPECT_CONTAINS(refusal(mesh), "86.6 mm, half the diagonal");
}

TEST(MeshRepair, NonManifoldEdgeIsRefused) {
  // A wall inside the box, closed on all its sides, divides it: neither half is the body.
  TriangleMesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.triangles.push_back({0, 2, 7});
  mesh.triangles.push_back({0, 7, 5});
  EXPECT_CONTAINS(refusal(mesh), "non-manifold");
  // Two bodies that share an edge.
  const TriangleMesh pair = joined(box({0, 0, 0}, {1, 1, 1}), box({1, 1, 0}, {2, 2, 1}));
  EXPECT_CONTAINS(refusal(pair),
                  "non-manifold: 1 edge is shared by more than two triangles, the first between "
                  "vertices 3 and 7");
}

TEST(MeshRepair, VertexWhereTheSurfaceTouchesItselfIsSplit) {
  // A cavity whose corner lies on a corner of a dented box: welded they would share a vertex.
  TriangleMesh cavity = box({0.5, 0.5, 0.5}, {0.7, 0.7, 0.7});
  turnInsideOut(cavity);
  TriangleMesh outer = box({0, 0, 0}, {1, 1, 1});
  outer.vertices.emplace_back(0.5, 0.5, 0.5);  // dent of the face z = 0
  outer.triangles.erase(outer.triangles.begin(), outer.triangles.begin() + 2);
  for (const auto& [a, b] : {std::pair{0, 2}, {2, 3}, {3, 1}, {1, 0}}) outer.triangles.push_back({a, b, 8});
  const TriangleMesh mesh = joined(outer, cavity);
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  EXPECT_NEAR(enclosedVolume(out.mesh), 1 - 0.5 / 3 - 0.008, 1e-12);
  EXPECT_EQ(out.mesh.vertices.size(), mesh.vertices.size());
}

TEST(MeshRepair, DisjointBodiesAreRefused) {
  const TriangleMesh mesh = joined(sphere(), sphere(2, {0.3, 0, 0}));
  EXPECT_CONTAINS(refusal(mesh), "2 separate bodies (triangles: 512, 128), expected one");
}

TEST(MeshRepair, NestedComponentIsACavityWhateverItsWinding) {
  for (const bool inward : {false, true}) {
    TriangleMesh inner = sphere(2, {0.01, 0, 0}, 0.05);
    const double hole = enclosedVolume(inner);
    if (inward) turnInsideOut(inner);
    const TriangleMesh mesh = joined(inner, sphere());
    const RepairedMesh out = repairMesh(mesh);
    expectWhole(out, mesh);
    EXPECT_NEAR(enclosedVolume(out.mesh), enclosedVolume(sphere()) - hole, 1e-12);
    const std::string turned = inward ? "" : ", which faced outward as a solid does, and was turned";
    EXPECT_EQ(out.notes, std::vector<std::string>{"kept a cavity of 128 triangles" + turned});
  }
}

TEST(MeshRepair, BodyInsideACavityIsASecondBody) {
  const TriangleMesh mesh = joined(joined(sphere(), sphere(2, {0, 0, 0}, 0.06)), sphere(1, {0, 0, 0}, 0.02));
  EXPECT_CONTAINS(refusal(mesh), "2 separate bodies");
}

TEST(MeshRepair, OverlappingPiecesAreRefused) {
  // Alike in size, too: taken for a body with a cavity they would enclose nothing.
  EXPECT_CONTAINS(refusal(joined(sphere(), sphere(3, {0.05, 0, 0}))), "separate pieces overlap");
  for (const double x : {-0.12, -0.05, 0.05, 0.12}) {
    EXPECT_CONTAINS(refusal(joined(sphere(), sphere(2, {x, 0.03, 0.02}))), "separate pieces overlap");
  }
}

TEST(MeshRepair, SmallSelfIntersectionWarns) {
  TriangleMesh mesh = sphere();
  // One vertex pushed sideways over its neighbours: a fold of a few triangles.
  const int v = 60;
  const auto edges = uniqueEdges(mesh);
  const auto atV = std::find_if(edges.begin(), edges.end(), [](const auto& edge) { return edge[1] == v; });
  const int w = (*atV)[0];
  mesh.vertices[v] += 1.6 * (mesh.vertices[w] - mesh.vertices[v]);
  mesh.vertices[v] *= 0.98;
  const RepairedMesh out = repairMesh(mesh);
  expectWhole(out, mesh);
  ASSERT_EQ(out.notes.size(), 1u);
  EXPECT_CONTAINS(out.notes[0], "the surface cuts through itself along ");
}

TEST(MeshRepair, LargeSelfIntersectionIsRefused) {
  // A bent bar whose ends run through each other.
  TriangleMesh mesh = sphere(4);
  for (auto& p : mesh.vertices) {
    const double angle = 3.7 * p.x() / 0.1, radius = 0.1 + 0.3 * p.y();
    p = Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), 0.3 * p.z());
  }
  EXPECT_CONTAINS(refusal(mesh), "the surface cuts through itself along ");
}

TEST(MeshRepair, FlatMeshIsRefused) {
  TriangleMesh mesh = sphere();
  for (auto& v : mesh.vertices) v.z() = 0;
  EXPECT_CONTAINS(refusal(mesh), "flat");
  mesh = box({0, 0, 0}, {1, 1, 1e-5});  // two sides, but nothing between them
  EXPECT_CONTAINS(refusal(mesh), "flat");
  mesh = box({0, 0, 0}, {1, 1, 0.01});
  EXPECT_NO_THROW(repairMesh(mesh));
}

TEST(MeshRepair, ManyDefectsAtOnceAndTheSameTwice) {
  TriangleMesh mesh = sphere();
  mesh.triangles.erase(mesh.triangles.begin() + 50);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 5) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  mesh.vertices.push_back(mesh.vertices[3]);
  for (auto& t : mesh.triangles) {
    if (t[0] == 3) t[0] = static_cast<int>(mesh.vertices.size()) - 1;
  }
  mesh.triangles.push_back(mesh.triangles[9]);
  const RepairedMesh first = repairMesh(mesh), second = repairMesh(mesh);
  expectWhole(first, mesh);
  EXPECT_EQ(first.mesh.vertices, second.mesh.vertices);
  EXPECT_EQ(first.mesh.triangles, second.mesh.triangles);
  EXPECT_EQ(first.notes, second.notes);
  EXPECT_EQ(first.mesh.triangles.size(), 512u);
  EXPECT_EQ(first.vertexOfInput.back(), first.vertexOfInput[3]);
}

TEST(SelfIntersection, AgreesWithAPairOfKnownLength) {
  // Two triangles that cross at right angles along 1.
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, -1}, {1, 1, 1}, {1, 3, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  auto cuts = findSelfIntersections(mesh);
  ASSERT_EQ(cuts.size(), 1u);
  EXPECT_NEAR(cuts[0].length, 2, 1e-12);
  mesh.vertices[3].z() = 0.5;  // now above
  EXPECT_TRUE(findSelfIntersections(mesh).empty());
  mesh.vertices[3] = {1, 1, 0};  // touches with a corner
  mesh.vertices[5].z() = 1;
  EXPECT_TRUE(findSelfIntersections(mesh).empty());
  mesh.vertices[5].z() = 0;  // lies on it with an edge: its neighbour over that edge may be on the other side
  EXPECT_EQ(findSelfIntersections(mesh).size(), 1u);
}

TEST(SelfIntersection, CoplanarOverlapCountsAndCommonSidesDoNot) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, 0}, {1, 0.5, 0}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  EXPECT_TRUE(findSelfIntersections(mesh).empty());
  mesh.triangles[1] = {2, 1, 4};  // folded back onto the first
  const auto cuts = findSelfIntersections(mesh);
  ASSERT_EQ(cuts.size(), 1u);
  EXPECT_GT(cuts[0].length, 1);
}

TEST(SelfIntersection, FindsWhatTestingEveryPairFinds) {
  // Two spheres of one mesh cross in a circle of radius sqrt(0.1^2 - 0.06^2) = 0.08.
  const TriangleMesh mesh = joined(sphere(4), sphere(4, {0.12, 0.001, 0.002}));
  double length = 0;
  for (const TriangleCut& cut : findSelfIntersections(mesh)) length += cut.length;
  EXPECT_NEAR(length, 2 * std::numbers::pi * 0.08, 0.01);
  EXPECT_TRUE(findSelfIntersections(sphere(5)).empty());
}

TEST(MeshTopology, SphereHasItsAreasVolumeAndNeighbours) {
  const TriangleMesh mesh = sphere(5);
  EXPECT_NEAR(enclosedVolume(mesh), 4.0 / 3 * std::numbers::pi * 1e-3, 2e-5);
  EXPECT_NEAR(surfaceArea(mesh), 4 * std::numbers::pi * 0.01, 2e-4);
  double sum = 0;
  for (const double a : vertexAreas(mesh)) sum += a;
  EXPECT_NEAR(sum, surfaceArea(mesh), 1e-12);
  const auto edges = uniqueEdges(mesh);
  EXPECT_EQ(mesh.vertices.size() - edges.size() + mesh.triangles.size(), 2u);  // Euler
  EXPECT_TRUE(std::is_sorted(edges.begin(), edges.end()));
  const IndexLists around = trianglesOfVertices(mesh);
  EXPECT_EQ(around.item.size(), 3 * mesh.triangles.size());
  const std::vector<Eigen::Vector3d> normals = vertexNormals(mesh);
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
    const auto touches = [v](const auto& edge) { return edge[0] == v || edge[1] == v; };
    EXPECT_EQ(std::count_if(edges.begin(), edges.end(), touches), around.first[v + 1] - around.first[v]);
    EXPECT_NEAR(normals[v].dot(mesh.vertices[v].normalized()), 1, 0.01);
  }
  const auto seenFrom = [&](const Eigen::Vector3d& point) {
    double angles = 0;
    for (const auto& t : mesh.triangles) angles += solidAngle(mesh, t, point);
    return angles / (4 * std::numbers::pi);
  };
  EXPECT_NEAR(seenFrom({0.01, 0.02, 0.03}), 1, 1e-12);
  EXPECT_NEAR(seenFrom({0.2, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(boundsDiagonal(mesh), 0.2 * std::sqrt(3), 1e-12);
}

}  // namespace medulla
