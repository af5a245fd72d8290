#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "physics/dynamics/loads.h"
#include "physics/model/soft_body_model.h"

// CSV files about vertices of the mesh file that a model was built from, counted from 0; a header row may come first.
// All throw std::runtime_error "FILE:LINE: ..." on vertices that the mesh does not have or that its repair dropped, on
// what is no finite number, and where there is no row.
namespace medulla {

// A vertex per row (header "vertex"): the nodes that they became, ascending, each once.
std::vector<int> readVertices(const std::string& path, const SoftBodyModel& model);
std::vector<int> parseVertices(std::string_view text, const std::string& name, const SoftBodyModel& model);

// vertex,fx[N],fy[N],fz[N] per row (the header), world frame: a load like `whole` but for its node and force.
std::vector<DeadLoad> readVertexForces(const std::string& path, const SoftBodyModel& model, const DeadLoad& whole);
std::vector<DeadLoad> parseVertexForces(std::string_view text, const std::string& name, const SoftBodyModel& model,
                                        const DeadLoad& whole);

}  // namespace medulla
