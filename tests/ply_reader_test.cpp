#include "app/files/ply_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>

#include "app/files/mesh_file.h"
#include "tests/complaint.h"
#include "tests/temporary_folder.h"

namespace medulla {
namespace {

using Eigen::Vector3d;

const std::string kVertices = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kFaces = "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kText = "ply\nformat ascii 1.0\n" + kVertices + kFaces;  // 9 lines
const std::string kPoints = "0 0 0\n1 0 0\n0 1 0\n0 0 0.1\n";
const std::string kTriangles = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
const std::vector<std::array<int, 3>> kTetrahedron{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

std::string refusal(const std::string& bytes) {
  return complaintOf([&] { parsePly(bytes, "a.ply"); });
}

template <typename T>
void append(std::string& out, T value, bool big) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big) std::reverse(bytes.begin(), bytes.end());
  out += bytes;
}

std::string binary(bool big, int lastCorner = 2) {
  std::string out =
      std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + kVertices + kFaces;
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 0.1F}) append(out, x, big);
  for (std::size_t t = 0; t < 4; ++t) {
    append(out, std::uint8_t{3}, big);
    for (std::size_t k = 0; k < 3; ++k) append(out, t == 3 && k == 2 ? lastCorner : kTetrahedron[t][k], big);
  }
  return out;
}

TEST(PlyReader, TextAndBothByteOrdersGiveTheSameMesh) {
  const TriangleMesh text = parsePly(kText + kPoints + kTriangles, "a.ply");
  ASSERT_EQ(text.vertices.size(), 4u);
  EXPECT_EQ(text.vertices[3], Vector3d(0, 0, 0.1));  // the double that these digits are
  EXPECT_EQ(text.triangles, kTetrahedron);
  for (const bool big : {false, true}) {
    const TriangleMesh mesh = parsePly(binary(big), "a.ply");
    ASSERT_EQ(mesh.vertices.size(), 4u);
    EXPECT_EQ(mesh.vertices[3], Vector3d(0, 0, 0.1F));
    EXPECT_EQ(mesh.triangles, kTetrahedron);
  }
}

TEST(PlyReader, PolygonsBecomeFansAndOtherElementsAndPropertiesAreSteppedOver) {
  const std::string header =
      "ply\r\nformat ascii 1.0\r\ncomment made by C:\\tools\\\r\nobj_info # none\r\nelement material 1\r\n"
      "property list uint8 int8 name\r\nelement vertex 4\r\nproperty uchar red\r\nproperty double z\r\n"
      "property double y\r\nproperty double x\r\nproperty float quality\r\nelement face 1\r\n"
      "property list uchar float texcoord\r\nproperty list uint8 uint32 vertex_index\r\nproperty int flags\r\n"
      "element edge 0\r\nproperty int vertex1\r\nend_header\r\n";
  const TriangleMesh mesh =
      parsePly(header + "2 65 66\r\n\r\n255 3 2 1 nan\r\n0 0 0 1 0\r\n0 0 1 1 0\r\n0 0 1 0 0\r\n2 0.5 0.5 4 0 1 2 3 -7",
               "a.ply");
  EXPECT_EQ(mesh.vertices[0], Vector3d(1, 2, 3));
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(PlyReader, AHeaderThatIsNotUnderstoodIsRefusedWithItsLine) {
  EXPECT_EQ(refusal("solid a\n"), "a.ply: is no PLY file: expected one that begins with the line ply");
  EXPECT_EQ(refusal("ply\nformat ascii 2.0\n").substr(0, 8), "a.ply:2:");
  EXPECT_EQ(refusal("ply\nelement vertex 1\nproperty half x\n").substr(0, 8), "a.ply:3:");
  EXPECT_EQ(refusal("ply\nelement face 1\nproperty list float int vertex_indices\n").substr(0, 8), "a.ply:3:");
  EXPECT_EQ(refusal("ply\nelement vertex 1\nelement vertex 1\n"), "a.ply:3: element 'vertex' stands twice");
  EXPECT_EQ(refusal("ply\nproperty float x\n").substr(0, 8), "a.ply:2:");
  EXPECT_EQ(refusal("ply\nend_header\n"), "a.ply:2: the header ends without a format");
  for (const char* count : {"-1", "4000000000", "many", ""})
    EXPECT_EQ(refusal("ply\nelement vertex " + std::string(count) + "\n"),
              "a.ply:2: expected element NAME COUNT, a count from 0 to 2147483647");
  EXPECT_NE(refusal("ply\nformat ascii 1.0\n" + kFaces).find("x, y and z"), std::string::npos);
  EXPECT_NE(refusal("ply\nformat ascii 1.0\n" + kVertices + "end_header\n" + kPoints).find("no triangles"),
            std::string::npos);
}

// Wherever a file is cut, it is refused: but for the last digits of a text, which are a number still.
TEST(PlyReader, AFileThatIsCutIsRefused) {
  const std::string text = kText + kPoints + kTriangles, bytes = binary(false);
  for (std::size_t k = 0; k + 2 < text.size(); ++k) EXPECT_NE(refusal(text.substr(0, k)), "") << k;
  for (std::size_t k = 0; k < bytes.size(); ++k) EXPECT_NE(refusal(bytes.substr(0, k)), "") << k;
  EXPECT_EQ(refusal("ply\nformat ascii 1.0\nelement ver"),
            "a.ply:3: expected element NAME COUNT, a count from 0 to 2147483647");
  EXPECT_EQ(refusal("ply\nformat ascii 1.0\n" + kVertices), "a.ply:6: the file ends within the header");
  EXPECT_EQ(refusal(kText + kPoints + "3 0 2 1\n3 0 1 3\n"), "a.ply:15: the file ends after 2 of 4 elements 'face'");
  EXPECT_EQ(refusal(kText + kPoints + "3 0 2 1\n3 0 1 3\n3 0"), "a.ply:16: fewer numbers than a 'face' has");
  EXPECT_EQ(
      refusal(kText + "0 0 0\n1 0 0\n0 1"),
      "a.ply: the file ends too early: its header counts 4 elements 'vertex', more than the 15 bytes behind it hold");
  EXPECT_EQ(refusal(bytes.substr(0, bytes.size() - 1)), "a.ply: the file ends after 3 of 4 elements 'face'");
}

TEST(PlyReader, ValuesThatMakeNoMeshAreRefused) {
  EXPECT_EQ(refusal(kText + "0 0 0\n1 0 0\n0 nan 0\n0 0 1\n" + kTriangles), "a.ply:12: vertex 2 is not finite");
  EXPECT_EQ(refusal(kText + kPoints + "3 0 2 1\n3 0 1 4\n3 1 2 3\n3 0 3 2\n"),
            "a.ply:15: 'face' 1 has a corner at vertex 4, expected a whole number from 0 to 3");
  for (const char* corner : {"-1", "0.5", "x", "1e30"})
    EXPECT_EQ(refusal(kText + kPoints + "3 0 2 " + corner + "\n3 0 1 3\n3 1 2 3\n3 0 3 2\n").substr(0, 9), "a.ply:14:");
  EXPECT_EQ(refusal(kText + kPoints + "2 0 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"),
            "a.ply:14: face 0 has 2 corners, expected at least 3");
  EXPECT_EQ(refusal(kText + kPoints + "3 0 2 1 7\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"),
            "a.ply:14: more numbers than a 'face' has");
  EXPECT_EQ(refusal(kText + kPoints + kTriangles + "3 0 1 2\n"),
            "a.ply:18: expected the end of the file after what the header counts");
  EXPECT_EQ(refusal(binary(true, 1 << 24)),
            "a.ply: 'face' 3 has a corner at vertex 16777216, expected a whole number from 0 to 3");
  EXPECT_EQ(refusal(binary(false) + "x"), "a.ply: expected the end of the file after what the header counts");
}

TEST(PlyReader, AListLongerThanTheFileIsRefused) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\n" + kVertices +
                      "element face 1\nproperty list uint int vertex_indices\nend_header\n" +
                      std::string(4 * 3 * sizeof(float), '\0');
  append(bytes, std::uint32_t{4000000000}, false);
  EXPECT_EQ(refusal(bytes), "a.ply: the file ends after 0 of 1 elements 'face'");
}

TEST(PlyReader, ReadsFilesByTheirName) {
  const TemporaryFolder folder;
  folder.write("a.PLY", binary(false));
  const TriangleMesh mesh = readMesh(folder / "a.PLY", 0.01);
  EXPECT_EQ(mesh.vertices[1], Vector3d(0.01, 0, 0));
  EXPECT_EQ(mesh.triangles, kTetrahedron);
}

TEST(PlyReader, NoPropertyStandsTwiceAndVerticesAre) {
  const std::string header = "ply\nformat ascii 1.0\n";
  EXPECT_NE(refusal(header + kVertices + "property float x\n" + kFaces).find("a.ply:7: "), std::string::npos);
  const std::string twice =
      "element face 4\nproperty list uchar int vertex_index\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  EXPECT_NE(refusal(header + kVertices + twice).find("twice"), std::string::npos);
  std::string none = kVertices;
  none[none.find('4')] = '0';
  EXPECT_NE(refusal(header + none + kFaces + kTriangles).find("no vertices"), std::string::npos);
}

}  // namespace
}  // namespace medulla
