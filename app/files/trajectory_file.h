#pragma once

#include <string>
#include <string_view>

#include "app/files/output_file.h"
#include "haptics/tool_input.h"

namespace medulla {

// CSV with the header t[s],x[m],y[m],z[m],qw,qx,qy,qz,grip in this order; # starts a comment; grip in 0..1; the further
// columns fx[N],fy[N],fz[N] (all three or none) are the force measured on the hand. For samples see addSample().
// Throws std::runtime_error "FILE:LINE: ...".
Trajectory readTrajectory(const std::string& path);

// The same from text in memory; `name` stands for the file in errors.
Trajectory parseTrajectory(std::string_view text, const std::string& name);

// Appends what a file of whatever format says at a line. The orientation may be off unit length by 1e-3 and is
// normalised; one that is unit up to rounding stays as it is, so that what was written is read back to the bit. Throws
// "FILE:LINE: ..." for another length, a position beyond kToolReach, a time beyond 1e9 s and one that is not after the
// one before.
void addSample(Trajectory& trajectory, ToolSample sample, const std::string& name, int line);
// N, world frame, of the latest sample. Throws "FILE:LINE: ..." beyond 1 MN: squares of such are summed up.
void addMeasuredForce(Trajectory& trajectory, const Eigen::Vector3d& force, const std::string& name, int line);

// Writes the format that readTrajectory() reads, with the force columns, every number to the last bit. Errors are those
// of OutputFile.
class TrajectoryFile {
 public:
  explicit TrajectoryFile(const std::string& path);
  void write(const ToolSample& sample, const Eigen::Vector3d& force);
  void finish() { file_.finish(); }
  void commit() { file_.commit(); }

 private:
  OutputFile file_;
  std::string line_;
};

}  // namespace medulla
