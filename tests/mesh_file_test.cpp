#include "app/files/mesh_file.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "app/files/obj_reader.h"
#include "app/files/off_reader.h"
#include "tests/complaint.h"
#include "tests/temporary_folder.h"

namespace medulla {

using Eigen::Vector3d;

static const std::string kTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
static const std::string kFaces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

static std::string objRefusal(const std::string& text) {
  return complaintOf([&] { parseObj(text, "a.obj"); });
}

static std::string offRefusal(const std::string& text) {
  return complaintOf([&] { parseOff(text, "a.off"); });
}

// Writes a file into the folder and gives its path.
static std::string written(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
  folder.write(name, text);
  return folder / name;
}

TEST(ObjReader, KeepsOrderAndDoubles) {
  const TriangleMesh mesh = parseObj(
      "# comment\nmtllib a.mtl\no body\nv 0.1 -2.5e-3 +3\r\nv 1 0 0 1.0\nvn 0 0 1\nvt 0 0\n\nv 0 1 0 0.5 0.5 0.5\n"
      "v 7 8 9 # unused\ns off\nusemtl x\nf 3 1 2\n",
      "a.obj");
  ASSERT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.vertices[0], Vector3d(0.1, -2.5e-3, 3));  // the same doubles as the compiler makes of these digits
  EXPECT_EQ(mesh.vertices[3], Vector3d(7, 8, 9));
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<int, 3>>{{2, 0, 1}}));
}

TEST(ObjReader, EveryFormOfFace) {
  const std::string vertices = kTetrahedron + "vt 0 0\nvn 0 0 1\n";
  const std::vector<std::array<int, 3>> expected{{0, 2, 1}};
  for (const std::string face : {"f 1 3 2", "f 1/1 3/1 2/1", "f 1//1 3//1 2//1", "f 1/1/1 3/1/1 2/1/1", "f -4 -2 -3",
                                 "f -4/-1/-1 -2/-1/-1 -3/-1/-1", "  f\t1  3 \\\n 2", "f 1 3 2 # end", "fo 1 3 2"}) {
    EXPECT_EQ(parseObj(vertices + face, "a.obj").triangles, expected) << face;
  }
  // A face may come before its vertices, but counting back starts where it stands.
  EXPECT_EQ(parseObj("f 1 3 2\n" + vertices, "a.obj").triangles, expected);
  EXPECT_EQ(objRefusal("v 0 0 0\nf -1 -2 -3\n" + vertices).substr(0, 8), "a.obj:2:");
}

TEST(ObjReader, PolygonsBecomeFans) {
  const TriangleMesh mesh = parseObj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv -1 0.5 0\nf 1 2 3 4 5\n", "a.obj");
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(ObjReader, ConcavePolygonsBeyondWhatIsCutAreRefused) {
  std::string obj, face = "f";
  for (int k = 0; k < 1040; ++k) {  // a comb
    obj += fmt::format("v {} {} 0\n", k < 1038 ? k : 2076 - k, k < 1038 ? k % 2 : -1);
    face += fmt::format(" {}", k + 1);
  }
  EXPECT_NE(complaintOf([&] { parseObj(obj + face + "\n", "a.obj"); }).find("a concave face of 1040 corners"),
            std::string::npos);
}

// Of stars, and of an L, whichever corner comes first: triangles that all face as the polygon does and make up its
// area.
TEST(ObjReader, ConcavePolygonsAreCutWithoutAFold) {
  constexpr int kCorners = 12;
  for (int first = 0; first < kCorners; ++first) {
    std::string face = "f", vertices;
    std::vector<Vector3d> corners;
    for (int k = 0; k < kCorners; ++k) {
      const double angle = 2 * std::numbers::pi * k / kCorners, radius = k % 2 == 0 ? 1 + 0.1 * k : 0.3;
      corners.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0.02 * (k % 3));
      vertices += fmt::format("v {} {} {}\n", corners[k].x(), corners[k].y(), corners[k].z());
      face += fmt::format(" {}", (k + first) % kCorners + 1);
    }
    double area = 0, sum = 0;
    for (int k = 0; k < kCorners; ++k) area += corners[k].cross(corners[(k + 1) % kCorners]).z();
    const TriangleMesh mesh = parseObj(fmt::format("{}\n{}", face, vertices), "a.obj");
    ASSERT_EQ(mesh.triangles.size(), kCorners - 2u);
    for (const auto& [a, b, c] : mesh.triangles) {
      const double part = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).z();
      EXPECT_GT(part, 0);
      sum += part;
    }
    EXPECT_NEAR(sum, area, 1e-12);
  }
  const std::string ell = "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\n";
  EXPECT_EQ(parseObj(ell + "f 3 4 5 6 1 2", "a.obj").triangles,
            (std::vector<std::array<int, 3>>{{1, 2, 3}, {3, 4, 5}, {3, 5, 0}, {3, 0, 1}}));
}

TEST(ObjReader, APolygonThatCutsItselfStaysAFan) {
  const TriangleMesh mesh = parseObj("v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4", "a.obj");
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(ObjReader, NotANumberAndInfinityAreRefusedWithTheirLine) {
  for (const std::string bad : {"nan", "NaN", "-nan", "inf", "-inf", "Infinity", "nan(1)"}) {
    EXPECT_EQ(objRefusal("v 0 0 0\n\nv 1 " + bad + " 0\n"), "a.obj:3: expected a finite number, found '" + bad + "'");
  }
  EXPECT_EQ(objRefusal("v 0 0 1e999\n"), "a.obj:1: expected a finite number, found '1e999'");
}

TEST(ObjReader, MalformedLinesAreRefusedWithTheirLine) {
  EXPECT_EQ(objRefusal("v 0 0\n"), "a.obj:1: expected 'v x y z'");
  EXPECT_EQ(objRefusal("v 0 0 1,5\n"), "a.obj:1: expected a finite number, found '1,5'");
  EXPECT_EQ(objRefusal("v 0 0 +-1\n"), "a.obj:1: expected a finite number, found '+-1'");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2\n"), "a.obj:5: expected a face of at least 3 corners");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 x\n"), "a.obj:5: expected an integer, found 'x'");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 /3\n"), "a.obj:5: expected an integer, found ''");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 3.5\n"), "a.obj:5: expected an integer, found '3.5'");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 3/a\n"),
            "a.obj:5: expected a face corner v, v/vt, v//vn or v/vt/vn, found '3/a'");
}

TEST(ObjReader, IndicesOutOfRangeAreRefusedWithTheirLine) {
  EXPECT_EQ(objRefusal(kTetrahedron + kFaces + "f 1 2 5\n"),
            "a.obj:9: face refers to vertex 5, but the file has only 4");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 0 1 2\n"), "a.obj:5: vertex 0 in a face: OBJ counts from 1");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 -5\n"), "a.obj:5: vertex '-5' in a face, but only 4 before");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 2147483648\n").substr(0, 8), "a.obj:5:");
  EXPECT_EQ(objRefusal(kTetrahedron + "f 1 2 99999999999999999999\n").substr(0, 8), "a.obj:5:");
  EXPECT_EQ(objRefusal(kTetrahedron), "a.obj: no triangles in this OBJ file");
}

TEST(OffReader, HeaderVariants) {
  const std::string body = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  for (const std::string header :
       {"OFF\n4 4 6\n", "OFF 4 4 6\n", "OFF4 4 6\n", "# c\nOFF # d\n\n4 4\n", "OFF\r\n4 4 0\r\n", "off\n4 4 0\n",
        "coff\n4 4 0\n", "COFF\n4 4 0\n", "NOFF 4 4 0\n", "STCNOFF 4 4 0\n"}) {
    const TriangleMesh mesh = parseOff(header + body, "a.off");
    ASSERT_EQ(mesh.vertices.size(), 4u) << header;
    EXPECT_EQ(mesh.vertices[3], Vector3d(0, 0, 1));
    EXPECT_EQ(mesh.triangles, (std::vector<std::array<int, 3>>{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}));
  }
  EXPECT_EQ(offRefusal("4OFF\n4 4 6\n" + body), "a.off:1: expected an OFF header, found '4OFF'");
  EXPECT_EQ(offRefusal("OFFS\n4 4 6\n" + body), "a.off:1: expected an OFF header, found 'OFFS'");
  EXPECT_EQ(offRefusal("OFF BINARY\n"), "a.off:1: binary OFF is not supported, expected text");
}

TEST(OffReader, PolygonsColoursAndComments) {
  const TriangleMesh mesh = parseOff(
      "COFF 4 1 0\n0 0 0 255 0 0\n1 0 0 255 0 0 # red\n\n1 1 0 1 1 1\n0 1 0 1 1 1\n4 0 1 2 3 0.5 0.5 0.5\n", "a.off");
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(OffReader, LyingCountsAreRefused) {
  EXPECT_EQ(offRefusal("OFF\n2000000000 2000000000 0\n0 0 0\n").substr(0, 48),
            "a.off:2: the header counts 2000000000 vertices a");
  EXPECT_EQ(offRefusal("OFF\n-1 4 0\n"), "a.off:2: expected counts that are not negative");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 0\n"), "a.off:4: the file ends after 2 of 3 vertices");
  EXPECT_EQ(offRefusal("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "a.off:6: the file ends after 1 of 2 faces");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 2 1\n"),
            "a.off:7: expected the end of the file after the faces that the header counts");
  EXPECT_EQ(offRefusal("OFF\n"), "a.off:1: expected the numbers of vertices, faces and edges");
  EXPECT_EQ(offRefusal("OFF\n0 0 0\n"), "a.off: no triangles in this OFF file");
}

TEST(OffReader, BadValuesAreRefusedWithTheirLine) {
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"),
            "a.off:4: expected a finite number, found 'nan'");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 -inf\n0 1 0\n3 0 1 2\n"),
            "a.off:4: expected a finite number, found '-inf'");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
            "a.off:6: face refers to vertex 3, expected 0 to 2");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
            "a.off:6: face refers to vertex -1, expected 0 to 2");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n"),
            "a.off:6: the face announces 4 corners but lists 3");
  EXPECT_EQ(offRefusal("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n"),
            "a.off:6: expected a face of at least 3 corners, found '2'");
}

TEST(MeshFile, UnitsScaleToMetres) {
  const TemporaryFolder folder;
  EXPECT_EQ(metresPerUnit("m"), 1);
  EXPECT_EQ(metresPerUnit("cm"), 0.01);
  EXPECT_EQ(metresPerUnit("mm"), 0.001);
  EXPECT_EQ(metresPerUnit("inch"), 0.0254);
  EXPECT_EQ(complaintOf([] { metresPerUnit("feet"); }), "unknown unit 'feet', expected m, cm, mm, micron or inch");
  const TriangleMesh mesh = readMesh(written(folder, "a.OBJ", kTetrahedron + kFaces), metresPerUnit("mm"));
  EXPECT_EQ(mesh.vertices[1], Vector3d(0.001, 0, 0));
}

// Debian's assimp ends the program where an assertion of its own fails, and crashes on an empty LightWave scene.
TEST(MeshFile, WhatAssimpWouldEndTheProgramForIsRefused) {
  const TemporaryFolder folder;
  std::string path = written(
      folder, "short.gltf",
      R"({"asset":{"version":"1.0"},"buffers":{"b":{"type":"arraybuffer","uri":"data:application/octet-stream;base64,AAAA"}},)"
      R"("bufferViews":{"v":{"buffer":"b","byteOffset":0,"byteLength":3}},)"
      R"("accessors":{"a":{"bufferView":"v","byteOffset":0,"componentType":5126,"count":3,"type":"VEC3"}},)"
      R"("meshes":{"m":{"primitives":[{"attributes":{"POSITION":"a"}}]}},"nodes":{"n":{"meshes":["m"]}},)"
      R"("scenes":{"s":{"nodes":["n"]}},"scene":"s"})");
  EXPECT_TRUE(complaintOf([&] { readMesh(path); }).starts_with(path + ": not a readable mesh: assimp expected "));
  path = written(folder, "empty.lws", "  ");
  EXPECT_TRUE(complaintOf([&] { readMesh(path); }).starts_with(path + ": unknown mesh format '.lws'"));
}

TEST(MeshFile, PathsThatHoldNoMeshAreRefusedInOneLine) {
  const TemporaryFolder folder;
  const auto read = [](const std::string& path) { return complaintOf([&] { readMesh(path); }); };
  const std::string missing = folder / "missing.obj";
  EXPECT_EQ(read(missing), missing + ": cannot be opened: No such file or directory");
  EXPECT_EQ(read(folder.path()), folder.path() + ": is a folder, expected a mesh file");
  EXPECT_EQ(read("/dev/null"), "/dev/null: is not a file, expected a mesh file");
  std::string path = written(folder, "empty.obj", "");
  EXPECT_EQ(read(path), path + ": is empty, expected a mesh file");
  path = written(folder, "a.txt", "hello");
  EXPECT_TRUE(read(path).starts_with(path + ": unknown mesh format '.txt', expected ")) << read(path);
  path = written(folder, "plain", "hello");
  EXPECT_TRUE(read(path).starts_with(path + ": unknown mesh format '', expected ")) << read(path);
}

TEST(MeshFile, ErrorsNameFileAndLine) {
  const TemporaryFolder folder;
  const std::string path = written(folder, "bad.obj", kTetrahedron + "v 0 nan 0\n" + kFaces);
  EXPECT_EQ(complaintOf([&] { readMesh(path); }), path + ":5: expected a finite number, found 'nan'");
}

static std::string asciiStl() {
  const std::array<std::array<const char*, 3>, 4> faces{{{"0 0 0", "0 1 0", "1 0 0"},
                                                         {"0 0 0", "1 0 0", "0 0 1"},
                                                         {"1 0 0", "0 1 0", "0 0 1"},
                                                         {"0 0 0", "0 0 1", "0 1 0"}}};
  std::string text = "solid a\n";
  for (const auto& face : faces) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (const char* v : face) text += std::string("vertex ") + v + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid a\n";
}

TEST(MeshFile, StlHasItsCornersJoined) {
  const TemporaryFolder folder;
  const TriangleMesh stl = readMesh(written(folder, "a.stl", asciiStl()), 0.01);
  EXPECT_EQ(stl.vertices.size(), 4u);
  EXPECT_EQ(stl.triangles.size(), 4u);
  EXPECT_NEAR(stl.vertices[1].norm(), 0.01, 1e-9);
}

// A triangle at z = 0, and one with texture coordinates at z = 1.
TEST(MeshFile, EachMeshOfAFileHasVerticesOfItsOwn) {
  const TemporaryFolder folder;
  const TriangleMesh mesh =
      readMesh(written(folder, "two.gltf",
                       R"({"asset": {"version": "2.0"}, "scene": 0,
"scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [
  {"attributes": {"POSITION": 0}}, {"attributes": {"POSITION": 1, "TEXCOORD_0": 2}}]}],
"buffers": [{"byteLength": 96, "uri": "data:application/octet-stream;base64,)"
                       R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAA)"
                       R"(gD8AAAAAAAAAAAAAAAAAAIA/AACAPwAAAAAAAIA/AAAAAAAAgD8AAIA/AAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/"}],
"bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 36},
  {"buffer": 0, "byteOffset": 72, "byteLength": 24}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
  {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 1], "max": [1, 1, 1]},
  {"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC2"}]})"),
               1);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  for (int t = 0; t < 2; ++t)
    for (const int corner : mesh.triangles[t]) EXPECT_EQ(mesh.vertices[corner].z(), t);
}

TEST(MeshFile, BadFilesOfOtherFormatsAreRefusedInOneLine) {
  const TemporaryFolder folder;
  for (const std::string name : {"a.stl", "a.ply", "a.gltf", "a.3ds", "a.dae", "a.x"}) {
    const std::string path = written(folder, name, "this is no mesh\nat all\n");
    EXPECT_TRUE(complaintOf([&] { readMesh(path); }).starts_with(path + ": ")) << name;
  }
  std::string text = asciiStl();
  text.replace(text.find("vertex 1 0 0"), 12, "vertex nan 0 0");
  const std::string path = written(folder, "nan.stl", text);
  EXPECT_TRUE(complaintOf([&] { readMesh(path); }).starts_with(path + ":6: "));
}

// Of these assimp takes any bytes for a skeleton, or does not end on damaged ones.
TEST(MeshFile, FormatsThatAreNotForExchangeAreNotRead) {
  const TemporaryFolder folder;
  for (const std::string name : {"a.ase", "a.md5mesh", "a.lws", "a.blend"}) {
    const std::string path = written(folder, name, std::string(64, '\0'));
    EXPECT_FALSE(isMeshFile(path));
    EXPECT_TRUE(complaintOf([&] { readMesh(path); }).starts_with(path + ": unknown mesh format '.")) << name;
  }
}

TEST(MeshFile, FilesWithoutTrianglesAreRefused) {
  const TemporaryFolder folder;
  const std::string stl = written(folder, "empty.stl", "solid a\nendsolid a\n");
  EXPECT_TRUE(complaintOf([&] { readMesh(stl); }).starts_with(stl + ": "));
  const std::string path = written(folder, "points.ply",
                                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                                   "y\nproperty float z\nend_header\n0 0 0\n");
  EXPECT_TRUE(complaintOf([&] { readMesh(path); }).starts_with(path + ": "));
}

}  // namespace medulla
