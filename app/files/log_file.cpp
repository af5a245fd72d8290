#include "app/files/log_file.h"

#include <fmt/format.h>

#include <cassert>

#include "app/files/number_text.h"

namespace medulla {

namespace {

template <typename T>
void appendCell(std::string& line, T value) {
  line += ',';
  appendNumber(line, value);
}

void appendCells(std::string& line, const Eigen::Vector3d& v) {
  for (int k = 0; k < 3; ++k) appendCell(line, v[k]);
}

}  // namespace

LogFile::LogFile(const std::string& path, const std::vector<std::string>& tools, const std::vector<std::string>& bodies)
    : file_(path), toolCount_(tools.size()), bodyCount_(bodies.size()) {
  std::string header = "t";
  for (const std::string& tool : tools) {
    for (const char* quantity : {"device", "proxy", "force"})
      header += fmt::format(",{0}.{1}.x,{0}.{1}.y,{0}.{1}.z", tool, quantity);
    header += fmt::format(",{0}.contact,{0}.held,{0}.clamped,{0}.slipped,{0}.energy", tool);
  }
  for (const std::string& body : bodies) header += fmt::format(",{0}.volume_ratio,{0}.dynamic_nodes", body);
  file_.write(header + ",energy.kinetic,energy.elastic,impulse_mismatch\n");
}

void LogFile::write(const LogRow& row) {
  assert(row.tools.size() == toolCount_ && row.bodies.size() == bodyCount_);
  line_.clear();
  appendNumber(line_, row.time);
  for (const ToolState& tool : row.tools) {
    appendCells(line_, tool.device);
    appendCells(line_, tool.proxy);
    appendCells(line_, tool.force);
    appendCell(line_, tool.inContact ? 1 : 0);
    appendCell(line_, tool.holding ? 1 : 0);
    appendCell(line_, tool.clamped ? 1 : 0);
    appendCell(line_, tool.slipped ? 1 : 0);
    appendCell(line_, tool.energy);
  }
  for (const LogBody& body : row.bodies) {
    appendCell(line_, body.volumeRatio);
    appendCell(line_, body.dynamicNodes);
  }
  appendCell(line_, row.energies.kinetic);
  appendCell(line_, row.energies.elastic);
  appendCell(line_, row.impulseMismatch);
  line_ += '\n';
  file_.write(line_);
}

}  // namespace medulla
