#include "app/files/off_reader.h"

#include <cctype>

#include "app/files/input_error.h"
#include "app/files/polygons.h"
#include "app/files/text.h"
#include "app/files/text_lines.h"

namespace medulla {

namespace {

struct Counts {
  long long vertices = 0, faces = 0;
};

// Every header ends in "OFF"; what may stand before it says what follows x y z on a vertex line. 4OFF and nOFF have
// other than three coordinates. Some programs write the counts right behind the keyword ("OFF8 6 0").
std::string_view afterKeyword(const TextLines& lines, std::string_view word) {
  const std::string small = lowered(word);
  const std::size_t off = small.find("off");
  const std::string prefix = small.substr(0, off == std::string_view::npos ? 0 : off);
  const std::string_view suffix = off == std::string_view::npos ? word : word.substr(off + 3);
  const bool known = off != std::string_view::npos && prefix.find_first_not_of("stcn") == std::string::npos &&
                     (suffix.empty() || std::isdigit(static_cast<unsigned char>(suffix[0])));
  if (!known) lines.fail("expected an OFF header, found " + inQuotes(word));
  return suffix;
}

Counts readHeader(TextLines& lines, std::size_t fileSize) {
  std::vector<std::string_view> words = lines.words();
  const std::string_view suffix = afterKeyword(lines, words[0]);
  words.erase(words.begin());
  if (!suffix.empty()) words.insert(words.begin(), suffix);
  if (words.empty()) {
    if (!lines.next()) lines.fail("expected the numbers of vertices, faces and edges");
    words = lines.words();
  }
  if (words[0] == "BINARY") lines.fail("binary OFF is not supported, expected text");
  if (words.size() != 2 && words.size() != 3) lines.fail("expected the numbers of vertices, faces and edges");
  const Counts counts{lines.integer(words[0]), lines.integer(words[1])};
  if (counts.vertices < 0 || counts.faces < 0) lines.fail("expected counts that are not negative");
  // The shortest vertex line is "0 0 0" and the shortest face line "3 0 1 2": a header that promises more than the
  // file can hold is refused before anything is allocated for it.
  const long long size = static_cast<long long>(fileSize);
  if (counts.vertices > size / 6 + 1 || counts.faces > size / 8 + 1) {
    lines.fail("the header counts " + std::to_string(counts.vertices) + " vertices and " +
               std::to_string(counts.faces) + " faces, more than a file of " + std::to_string(size) + " bytes holds");
  }
  return counts;
}

void readFace(const TextLines& lines, long long vertices, std::vector<int>& polygon) {
  const auto& words = lines.words();
  const long long corners = lines.integer(words[0]);
  if (corners < 3) lines.fail("expected a face of at least 3 corners, found " + inQuotes(words[0]));
  if (corners > static_cast<long long>(words.size()) - 1) {
    lines.fail("the face announces " + std::to_string(corners) + " corners but lists " +
               std::to_string(words.size() - 1));
  }
  polygon.clear();
  for (long long i = 1; i <= corners; ++i) {
    const long long index = lines.integer(words[i]);
    if (index < 0 || index >= vertices)
      lines.fail("face refers to vertex " + std::to_string(index) + ", expected 0 to " + std::to_string(vertices - 1));
    polygon.push_back(static_cast<int>(index));
  }
}

}  // namespace

TriangleMesh parseOff(std::string_view text, const std::string& name) {
  TextLines lines(text, name);
  if (!lines.next()) throw inputError(name, 0, "expected an OFF header, found nothing");
  const Counts counts = readHeader(lines, text.size());
  TriangleMesh mesh;
  mesh.vertices.reserve(counts.vertices);
  mesh.triangles.reserve(counts.faces);
  for (long long i = 0; i < counts.vertices; ++i) {
    if (!lines.next())
      lines.fail("the file ends after " + std::to_string(i) + " of " + std::to_string(counts.vertices) + " vertices");
    const auto& words = lines.words();
    if (words.size() < 3) lines.fail("expected a vertex 'x y z'");
    mesh.vertices.emplace_back(lines.number(words[0]), lines.number(words[1]), lines.number(words[2]));
  }
  std::vector<int> polygon;
  Polygons polygons;
  for (long long i = 0; i < counts.faces; ++i) {
    if (!lines.next())
      lines.fail("the file ends after " + std::to_string(i) + " of " + std::to_string(counts.faces) + " faces");
    readFace(lines, counts.vertices, polygon);
    polygons.add(polygon, mesh);
  }
  if (lines.next()) lines.fail("expected the end of the file after the faces that the header counts");
  if (mesh.triangles.empty()) throw inputError(name, 0, "no triangles in this OFF file");
  polygons.cutConcave(name, mesh);
  return mesh;
}

}  // namespace medulla
