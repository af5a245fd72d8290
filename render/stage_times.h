#pragma once

#include <string>
#include <vector>

namespace medulla {

// CPU time of the process over all threads, and of the calling thread alone, s.
double processCpuSeconds();
double threadCpuSeconds();

// By the clock, s; from an unknown beginning on.
double wallSeconds();

// What takes the time of one thread's repeated work, by stages that follow each other.
class StageTimes {
 public:
  struct Stage {
    std::string name;
    double wall = 0, cpu = 0;  // s, in all; CPU of the thread that starts and stops
  };
  void start(const std::string& name);  // ends the stage before; stages of one name add up
  void stop();
  const std::vector<Stage>& stages() const { return stages_; }  // in the order of their first start

 private:
  std::vector<Stage> stages_;
  int running_ = -1;
  double wall_ = 0, cpu_ = 0;
};

}  // namespace medulla
