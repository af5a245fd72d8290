#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "physics/model/soft_body_model.h"

// Where another program, finite elements as a rule, puts the vertices of a body's mesh at the end of a load case.
namespace medulla {

// What the other program's own run took and how far off it was.
struct ReferenceRun {
  int nodes = 0;
  double cpu = 0;                     // s
  double errorMax = 0, errorRms = 0;  // % of the largest displacement
};

struct Reference {
  // m, per node of the model, in the mesh's frame; none where no vertex of the mesh file became the node.
  std::vector<std::optional<Eigen::Vector3d>> displacement;
  std::vector<ReferenceRun> runs;
};

// A row of three numbers per vertex of the mesh file, in its order, in metres or in what a line "# unit NUMBER m" says;
// other lines that begin with # are remarks, but none that begins with "unit" in another form. Throws
// std::runtime_error "FILE:LINE: ..." on anything else, on another number of rows than the mesh has vertices, and where
// nothing moves.
Reference parseReference(std::string_view text, const std::string& name, const SoftBodyModel& model);

// Beside FILE.txt may lie FILE.time with what it cost: rows "case nodes seconds largest-error[%] RMS-error[%]".
// Throws std::runtime_error "FILE:LINE: ..." on anything else.
std::vector<ReferenceRun> parseReferenceRuns(std::string_view text, const std::string& name);

// Both.
Reference readReference(const std::string& path, const SoftBodyModel& model);

}  // namespace medulla
