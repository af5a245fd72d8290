#pragma once

#include <memory>
#include <vector>

#include "app/commands/run.h"

namespace medulla {

// What a run is asked to write, gathered frame by frame: log, motions of the tools, surfaces, state cache, times of the
// frames. Kept until the run is through: one that fails later overwrites nothing.
class RunRecorders {
 public:
  RunRecorders(const LoadedScene& loaded, const RunOptions& options);
  ~RunRecorders();
  void afterFrame(const Simulation& simulation, bool last);
  void finish(const Simulation& simulation);  // the last bytes; then commit(): each file under its name
  void commit(const Simulation& simulation);
  // How the force of tools whose trajectory has a measured one compares with that.
  std::vector<Result> forceResults() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
