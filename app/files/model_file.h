#pragma once

#include <string>

#include "physics/model/soft_body_model.h"

namespace medulla {

// The model file: XML whose long arrays are whitespace-separated text, from which reading gives the same bits.
void writeModel(const std::string& path, const SoftBodyModel& model);
// By the root element alone; false of what is no XML.
bool isModel(const std::string& path);
// Throws std::runtime_error "FILE:LINE: ..." on anything missing, unknown, out of range or inconsistent.
SoftBodyModel readModel(const std::string& path);

}  // namespace medulla
