#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "app/simulation.h"

namespace medulla {

// The scene's duration is over and something still moves.
struct NotAtRest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Whether a scene has come to rest: no node of a body has moved by more than a ten-thousandth of how far the body has
// gone, or two millionths of its size if that is more, for as long as its slowest mode takes for a swing, and neither a
// load nor a tool's motion is still to come. Judged by place: a speed says nothing of bodies that creep, and the node
// of a resting contact trembles.
class RestWatch {
 public:
  // Throws NotAtRest where a body is driven and never will be.
  RestWatch(const LoadedScene& loaded, const Simulation& simulation);
  void afterFrame(const Simulation& simulation);
  bool atRest() const;
  // Throws NotAtRest, which says so where the run had files to write.
  [[noreturn]] void fail(bool hasFiles) const;

 private:
  struct Body {
    std::string name;
    std::vector<Eigen::Vector3d> start, last;  // m, nodes: at the scene's start, and where it last was found elsewhere
    double size = 0, period = 0;               // m, s
    double movedAt = 0;                        // s
  };
  double busyUntil_ = 0, time_ = 0;  // s
  std::vector<Body> bodies_;
};

}  // namespace medulla
