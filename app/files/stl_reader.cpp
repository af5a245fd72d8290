#include "app/files/stl_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

#include "app/files/input_error.h"
#include "app/files/text.h"
#include "app/files/text_lines.h"

namespace medulla {

namespace {

using Eigen::Vector3d;
using Corners = std::array<Vector3d, 3>;

constexpr std::size_t kBinaryHeader = 80, kBinaryStart = kBinaryHeader + 4, kBinaryFacet = 50;

class JoinedCorners {
 public:
  void add(const Corners& corners) {
    std::array<int, 3> triangle;
    for (int k = 0; k < 3; ++k) {
      const Vector3d& p = corners[k];
      const int next = static_cast<int>(mesh.vertices.size());
      const auto [found, isNew] = vertexAt_.try_emplace({p.x(), p.y(), p.z()}, next);
      if (isNew) mesh.vertices.push_back(p);
      triangle[k] = found->second;
    }
    mesh.triangles.push_back(triangle);
  }

  TriangleMesh mesh;

 private:
  std::map<std::array<double, 3>, int> vertexAt_;
};

// ---- Text ------------------------------------------------------------------------------------------------

bool begins(const TextLines& lines, std::string_view first, std::string_view second = {}) {
  const auto& words = lines.words();
  if (lowered(words[0]) != first) return false;
  return second.empty() || (words.size() > 1 && lowered(words[1]) == second);
}

void nextLine(TextLines& lines) {
  if (!lines.next()) lines.fail("the file ends within a solid, expected endsolid");
}

void expectLine(TextLines& lines, std::string_view first, std::string_view second = {}) {
  nextLine(lines);
  if (!begins(lines, first, second))
    lines.fail(
        fmt::format("expected {}{}{}, found {}", first, second.empty() ? "" : " ", second, inQuotes(lines.words()[0])));
}

Corners readFacet(TextLines& lines) {
  Corners corners;
  expectLine(lines, "outer", "loop");
  for (Vector3d& corner : corners) {
    expectLine(lines, "vertex");
    const auto& words = lines.words();
    if (words.size() != 4) lines.fail(fmt::format("expected vertex X Y Z, found {} words", words.size()));
    for (int k = 0; k < 3; ++k) corner[k] = lines.number(words[k + 1]);
  }
  expectLine(lines, "endloop");
  expectLine(lines, "endfacet");
  return corners;
}

TriangleMesh parseText(std::string_view text, const std::string& name) {
  TextLines lines(text, name);
  JoinedCorners joined;
  while (lines.next()) {
    if (!begins(lines, "solid")) lines.fail("expected solid, found " + inQuotes(lines.words()[0]));
    for (nextLine(lines); !begins(lines, "endsolid"); nextLine(lines)) {
      if (!begins(lines, "facet")) lines.fail("expected facet or endsolid, found " + inQuotes(lines.words()[0]));
      joined.add(readFacet(lines));
    }
  }
  return std::move(joined.mesh);
}

// ---- Binary ----------------------------------------------------------------------------------------------

std::uint32_t littleEndian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int k = 3; k >= 0; --k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

std::size_t binarySize(std::string_view bytes) {
  return kBinaryStart + kBinaryFacet * littleEndian(bytes, kBinaryHeader);
}

TriangleMesh parseBinary(std::string_view bytes, const std::string& name) {
  const std::uint32_t count = littleEndian(bytes, kBinaryHeader);
  if (bytes.size() != binarySize(bytes))
    throw inputError(name, 0,
                     fmt::format("neither text nor whole: a binary STL of {} triangles has {} bytes, expected of {}",
                                 count, binarySize(bytes), bytes.size()));
  JoinedCorners joined;
  joined.mesh.triangles.reserve(count);
  for (std::uint32_t f = 0; f < count; ++f) {
    Corners corners;
    for (int k = 0; k < 9; ++k) {  // behind the normal's three
      const std::size_t at = kBinaryStart + kBinaryFacet * f + 4 * (3 + k);
      const double x = std::bit_cast<float>(littleEndian(bytes, at));
      if (!std::isfinite(x)) throw inputError(name, 0, fmt::format("a corner of triangle {} is not finite", f));
      corners[k / 3][k % 3] = x;
    }
    joined.add(corners);
  }
  return std::move(joined.mesh);
}

}  // namespace

// Some programs write "solid" into binary headers too: the size tells them apart.
TriangleMesh parseStl(std::string_view bytes, const std::string& name) {
  const bool hasCount = bytes.size() >= kBinaryStart, isBinary = hasCount && bytes.size() == binarySize(bytes);
  const std::size_t start = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  const bool isText = !isBinary && lowered(bytes.substr(start, 5)) == "solid";
  if (!isText && !hasCount) throw inputError(name, 0, "expected an STL file, text that begins with solid or binary");
  TriangleMesh mesh = isText ? parseText(bytes, name) : parseBinary(bytes, name);
  if (mesh.triangles.empty()) throw inputError(name, 0, "no triangles in this STL file");
  return mesh;
}

}  // namespace medulla
