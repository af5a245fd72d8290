#include "app/files/stl_reader.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>

#include "tests/complaint.h"

namespace medulla {

namespace {

constexpr float kTetrahedron[4][3][3] = {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}},
                                         {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}},
                                         {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                         {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}}};

std::string text() {
  std::string out = "solid a part of a body\n";
  for (const auto& facet : kTetrahedron) {
    out += "  facet normal nan nan nan\n    outer loop\n";
    for (const auto& v : facet)
      out += "      vertex " + std::to_string(v[0]) + " " + std::to_string(v[1]) + " " + std::to_string(v[2]) + "\n";
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid a part of a body\n";
}

void append(std::string& to, const void* value, std::size_t size) {
  to.append(static_cast<const char*>(value), size);
}

std::string binary(std::string header = "by hand") {
  header.resize(80);
  const std::uint32_t count = 4;
  append(header, &count, 4);
  for (const auto& facet : kTetrahedron) {
    const float normal[3] = {0, 0, 0};
    append(header, normal, sizeof normal);
    append(header, facet, sizeof facet);
    header.append(2, '\0');
  }
  return header;
}

std::string replaced(std::string in, const std::string& what, const std::string& by) {
  return in.replace(in.find(what), what.size(), by);
}

void expectTetrahedron(const TriangleMesh& mesh) {
  ASSERT_EQ(mesh.vertices.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 4u);
  for (int t = 0; t < 4; ++t)
    for (int k = 0; k < 3; ++k) {
      const auto& v = kTetrahedron[t][k];
      EXPECT_EQ(mesh.vertices[mesh.triangles[t][k]], Eigen::Vector3d(v[0], v[1], v[2]));
    }
}

std::string complaint(const std::string& bytes) {
  return complaintOf([&] { parseStl(bytes, "a.stl"); });
}

}  // namespace

TEST(StlReader, ReadsTextAndBinaryWithCornersJoined) {
  expectTetrahedron(parseStl(text(), "a.stl"));
  expectTetrahedron(parseStl(binary(), "a.stl"));
  expectTetrahedron(parseStl(binary("solid though it is binary"), "a.stl"));
  std::string shouted = replaced(text(), "solid", "SOLID");
  expectTetrahedron(parseStl(replaced(shouted, "facet normal nan nan nan", "FACET NORMAL 0 0 -1"), "a.stl"));
  expectTetrahedron(parseStl("solid C:\\parts\\" + text().substr(text().find('\n')), "a.stl"));  // no line goes on
  EXPECT_EQ(parseStl(text() + "\n" + text(), "a.stl").triangles.size(), 8u);                     // two solids
}

TEST(StlReader, KeepsAllDigitsOfText) {
  const TriangleMesh mesh =
      parseStl(replaced(text(), "vertex 0.000000 1.000000", "vertex 0 1.23456789012345"), "a.stl");
  EXPECT_EQ(mesh.vertices[1].y(), 1.23456789012345);
}

TEST(StlReader, RefusesWhatIsNoNumberByItsLine) {
  for (const std::string wrong : {"abc", "0,5", "0x", "0x10", "0.0.3", "3D-2", "nan", "1e400", "0 7", ""}) {
    const std::string said = complaint(replaced(text(), "vertex 0.000000", "vertex " + wrong));
    EXPECT_TRUE(said.starts_with("a.stl:4: ")) << wrong << ": " << said;
    EXPECT_LT(said.size(), 200u);
  }
  std::string infinite = binary();
  const float infinity = std::numeric_limits<float>::infinity();
  std::memcpy(infinite.data() + 84 + 12, &infinity, 4);
  EXPECT_EQ(complaint(infinite), "a.stl: a corner of triangle 0 is not finite");
}

TEST(StlReader, RefusesFilesThatAreCutAnywhere) {
  const std::string whole = text(), last = "endsolid";
  for (std::size_t size = 0; size < whole.rfind(last) + last.size(); ++size)
    EXPECT_TRUE(complaint(whole.substr(0, size)).starts_with("a.stl")) << size;
  const std::string bytes = binary();
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_TRUE(complaint(bytes.substr(0, size)).starts_with("a.stl: ")) << size;
  EXPECT_TRUE(complaint(bytes + "x").starts_with("a.stl: "));
}

TEST(StlReader, RefusesOtherLinesAndFilesWithoutTriangles) {
  EXPECT_TRUE(complaint(replaced(text(), "outer loop", "loop")).starts_with("a.stl:3: expected outer loop"));
  EXPECT_TRUE(complaint(replaced(text(), "    endloop\n", "")).starts_with("a.stl:7: expected endloop"));
  EXPECT_TRUE(complaint(text() + "facet").starts_with("a.stl:31: expected solid"));
  EXPECT_EQ(complaint("solid a\nendsolid a\n"), "a.stl: no triangles in this STL file");
  EXPECT_TRUE(complaint("no mesh").starts_with("a.stl: expected an STL file"));
}

}  // namespace medulla
