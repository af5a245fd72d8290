#pragma once

#include <memory>

#include "app/simulation.h"

namespace medulla {

// How a live servo kept time, and what its ticks cost.
struct LiveReport {
  long ticks = 0;
  long lateTicks = 0;                            // woken more than a tick after their time
  long standingTicks = 0;                        // without a new dynamics frame in time: the surface stood still
  double latest = 0;                             // s, the largest lateness of a tick
  double cpuMedian = 0, cpu999 = 0, cpuMax = 0;  // s per tick, of the servo's thread; half, 99.9 % and all of the ticks
};

// Runs a simulation's servo against the clock in a thread of its own (paper 5), while the caller's thread does the
// dynamics. Both work at once: while the servo blends the frames n - 1 and n, the dynamics makes n + 1 of what the
// servo handed over before. Live, the tissue therefore answers one dynamics frame later than in logical time; if every
// frame is ready in time, the run is the same each time, too.
//
// A tick that wakes late reads the device as of its own time and the next follow at once: none is left out. Where the
// dynamics is late, the surface stands still meanwhile.
class LiveServo {
 public:
  explicit LiveServo(Simulation& simulation);
  ~LiveServo();

  // One dynamics frame, as soon as the servo hands over; the first starts it. Throws what the servo or the dynamics
  // could not go on with.
  void advanceFrame();

  LiveReport stop();  // after the last frame: what follows is no part of the run that the servo kept time with

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
