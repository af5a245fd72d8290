#pragma once

#include <string>
#include <vector>

#include "app/files/output_file.h"
#include "haptics/servo.h"
#include "physics/dynamics/world.h"

namespace medulla {

struct LogBody {
  double volumeRatio = 1;  // enclosed volume over rest
  int dynamicNodes = 0;    // surface nodes that are masses of their own, and awake
};

// One line of the log: the state at one moment. Everything in it follows from scene and trajectory alone, so that two
// logs of the same run compare byte for byte; timings belong elsewhere.
struct LogRow {
  double time = 0;               // s
  std::vector<ToolState> tools;  // in the order of the names given to LogFile
  std::vector<LogBody> bodies;   // the same
  Energies energies;
  double impulseMismatch = 0;  // %, over the last dynamics frame: impulse felt by the hand against that given to bodies
};

// CSV, a row per dynamics frame or per tick. Columns, in SI units: t, then per tool NAME.device.x, .y, .z,
// NAME.proxy.*, NAME.force.* (on the hand), NAME.contact, NAME.held, NAME.clamped, NAME.slipped (0 or 1), NAME.energy
// (J, handed to the user so far), per body NAME.volume_ratio, NAME.dynamic_nodes, then energy.kinetic, energy.elastic,
// impulse_mismatch. Numbers are the shortest that read back as the same bits. Errors are those of OutputFile.
class LogFile {
 public:
  LogFile(const std::string& path, const std::vector<std::string>& tools, const std::vector<std::string>& bodies);
  void write(const LogRow& row);
  void finish() { file_.finish(); }
  void commit() { file_.commit(); }

 private:
  OutputFile file_;
  std::size_t toolCount_, bodyCount_;
  std::string line_;
};

}  // namespace medulla
