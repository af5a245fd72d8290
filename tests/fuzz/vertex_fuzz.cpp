#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string_view>

#include "app/files/reference_file.h"
#include "app/files/vertex_file.h"

// Whatever the bytes: either nodes, forces and displacements of a small model, or one std::runtime_error.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  medulla::SoftBodyModel model;
  model.nodeOfInputVertex = {2, -1, 0, 1, 1};
  try {
    for (const int node : medulla::parseVertices(text, "fuzz.csv", model))
      if (node < 0 || node > 2) std::abort();
  } catch (const std::runtime_error&) {
  }
  try {
    for (const medulla::DeadLoad& load : medulla::parseVertexForces(text, "fuzz.csv", model, {}))
      if (load.node < 0 || load.node > 2 || !load.force.allFinite()) std::abort();
  } catch (const std::runtime_error&) {
  }
  model.restNodes.resize(3);
  try {
    const medulla::Reference reference = medulla::parseReference(text, "fuzz.txt", model);
    for (const auto& moved : reference.displacement)
      if (moved && !moved->allFinite()) std::abort();
  } catch (const std::runtime_error&) {
  }
  try {
    for (const medulla::ReferenceRun& run : medulla::parseReferenceRuns(text, "fuzz.time"))
      if (!(run.cpu > 0) || run.nodes < 1) std::abort();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
