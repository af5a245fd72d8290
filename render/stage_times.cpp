#include "render/stage_times.h"

#include <ctime>

#include <algorithm>

namespace medulla {

static double secondsOf(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double processCpuSeconds() {
  return secondsOf(CLOCK_PROCESS_CPUTIME_ID);
}

double threadCpuSeconds() {
  return secondsOf(CLOCK_THREAD_CPUTIME_ID);
}

double wallSeconds() {
  return secondsOf(CLOCK_MONOTONIC);
}

void StageTimes::start(const std::string& name) {
  stop();
  const auto known = std::find_if(stages_.begin(), stages_.end(), [&](const Stage& s) { return s.name == name; });
  running_ = static_cast<int>(known - stages_.begin());
  if (known == stages_.end()) stages_.push_back({name, 0, 0});
  wall_ = wallSeconds();
  cpu_ = threadCpuSeconds();
}

void StageTimes::stop() {
  if (running_ < 0) return;
  stages_[running_].wall += wallSeconds() - wall_;
  stages_[running_].cpu += threadCpuSeconds() - cpu_;
  running_ = -1;
}

}  // namespace medulla
