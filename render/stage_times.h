#pragma once

#include <string>
#include <vector>

namespace medulla {

// What takes the time of repeated work, by stages that follow each other.
class StageTimes {
 public:
  struct Stage {
    std::string name;
    double wall = 0, cpu = 0;  // s, in all; CPU of every thread of this process, also of those that work on meanwhile
  };
  void start(const std::string& name);  // ends the stage before; stages of one name add up
  void stop();
  const std::vector<Stage>& stages() const { return stages_; }  // in the order of their first start

 private:
  std::vector<Stage> stages_;
  int running_ = -1;
  double wall_ = 0, cpu_ = 0;
};

// CPU time of the process over all threads, s.
double processCpuSeconds();

// By the clock, s; from an unknown beginning on.
double wallSeconds();

}  // namespace medulla
