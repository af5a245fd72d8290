#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "app/files/obj_reader.h"
#include "app/files/off_reader.h"
#include "app/files/ply_reader.h"
#include "app/files/stl_reader.h"
#include "physics/model/mesh_repair.h"
#include "physics/model/mesh_topology.h"

// Readers and repair together: whatever the bytes, the answer is a whole mesh or one line of complaint.
namespace medulla {

static void require(bool condition) {
  if (!condition) std::abort();
}

static void requireWhole(const RepairedMesh& out, const TriangleMesh& input) {
  for (const auto& sides : trianglesOnEdges(out.mesh)) require(sides == std::array<int, 3>{2, 2, 2});
  require(enclosedVolume(out.mesh) > 0);
  for (const auto& v : out.mesh.vertices) require(v.allFinite());
  require(out.vertexOfInput.size() == input.vertices.size());
  const int count = static_cast<int>(out.mesh.vertices.size());
  for (const int v : out.vertexOfInput) require(v >= -1 && v < count);
  for (const auto& t : out.mesh.triangles) {
    for (int k = 0; k < 3; ++k) require(t[k] >= 0 && t[k] < count && t[k] != t[(k + 1) % 3]);
  }
}

}  // namespace medulla

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const medulla::TriangleMesh mesh =
        text.starts_with("ply")                                                    ? medulla::parsePly(text, "fuzz.ply")
        : text.starts_with("solid") || text.starts_with(std::string_view("\0", 1)) ? medulla::parseStl(text, "fuzz.stl")
        : text.substr(0, 16).find("OFF") != std::string_view::npos                 ? medulla::parseOff(text, "fuzz.off")
                                                                   : medulla::parseObj(text, "fuzz.obj");
    medulla::requireWhole(medulla::repairMesh(mesh), mesh);
  } catch (const std::runtime_error& e) {
    medulla::require(std::string_view(e.what()).find('\n') == std::string_view::npos);
  }
  return 0;
}
