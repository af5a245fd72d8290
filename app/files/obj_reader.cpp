#include "app/files/obj_reader.h"

#include <cctype>
#include <limits>

#include "app/files/input_error.h"
#include "app/files/polygons.h"
#include "app/files/text.h"
#include "app/files/text_lines.h"

namespace medulla {

namespace {

Eigen::Vector3d vertex(const TextLines& lines) {
  // A fourth number (w) or three more (a colour) may follow: neither changes the shape.
  if (lines.words().size() < 4) lines.fail("expected 'v x y z'");
  return {lines.number(lines.words()[1]), lines.number(lines.words()[2]), lines.number(lines.words()[3])};
}

// The vertex of one face corner, 0-based. Only the vertex counts, but v/vt/vn must be well formed.
int corner(const TextLines& lines, std::string_view word, std::size_t vertices) {
  const std::size_t slash = word.find('/');
  const long long given = lines.integer(word.substr(0, slash));
  for (const char c : word.substr(std::min(slash, word.size())))
    if (c != '/' && c != '-' && !std::isdigit(static_cast<unsigned char>(c)))
      lines.fail("expected a face corner v, v/vt, v//vn or v/vt/vn, found " + inQuotes(word));
  const long long count = static_cast<long long>(vertices);
  if (given == 0) lines.fail("vertex 0 in a face: OBJ counts from 1");
  if (given < -count)
    lines.fail("vertex " + inQuotes(word) + " in a face, but only " + std::to_string(count) + " before");
  // A positive index may name a vertex further down: the caller checks it against the whole file.
  if (given > std::numeric_limits<int>::max()) lines.fail("vertex " + inQuotes(word) + " out of range");
  return static_cast<int>(given > 0 ? given - 1 : count + given);
}

}  // namespace

TriangleMesh parseObj(std::string_view text, const std::string& name) {
  TriangleMesh mesh;
  int largest = -1, largestLine = 0;
  TextLines lines(text, name, true);
  std::vector<int> polygon;
  Polygons polygons;
  while (lines.next()) {
    const auto& words = lines.words();
    if (words[0] == "v") mesh.vertices.push_back(vertex(lines));
    if (words[0] != "f" && words[0] != "fo") continue;  // the latter in files of before 1995
    if (words.size() < 4) lines.fail("expected a face of at least 3 corners");
    polygon.clear();
    for (std::size_t i = 1; i < words.size(); ++i) {
      polygon.push_back(corner(lines, words[i], mesh.vertices.size()));
      if (polygon.back() <= largest) continue;
      largest = polygon.back();
      largestLine = lines.line();
    }
    polygons.add(polygon, mesh);
  }
  if (mesh.triangles.empty()) throw inputError(name, 0, "no triangles in this OBJ file");
  if (largest >= static_cast<int>(mesh.vertices.size())) {
    throw inputError(name, largestLine,
                     "face refers to vertex " + std::to_string(largest + 1LL) + ", but the file has only " +
                         std::to_string(mesh.vertices.size()));
  }
  polygons.cutConcave(name, mesh);
  return mesh;
}

}  // namespace medulla
