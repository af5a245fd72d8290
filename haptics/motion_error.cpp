#include "haptics/motion_error.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace medulla {

void noteFelt(const Eigen::Vector3d& force, const WayAndChange& ways, MotionError& error) {
  MotionError::FeltFrame& frame = error.frames[0];
  frame.force += force;
  frame.ways += ways;
  ++frame.ticks;
}

void learnMotionError(const Eigen::Vector3d& gave, int ticks, int framesLate, double duration, MotionError& error) {
  constexpr double kMemory = 0.1;  // s, as of what else is learnt of tissue; of the squares alone half or twice as long
                                   // feels the same within a few per cent
  constexpr double kGentle = 0.02;                 // s; none kinks pushes of 5 ms frames by 2 mN, as slow as the memory
                                                   // leaves a free ball that was sped up a tenth too light
  constexpr double kRidge = 0.01, kLeast = 1e-24;  // of the moments; m2: what is given off without a way says nothing
  if (error.frames[0].ticks < ticks) error.frames[0] = {};
  const MotionError::FeltFrame& frame = error.frames[framesLate];
  if (frame.ticks > 0) {
    const WayAndChange ways = frame.ways / frame.ticks;
    const Eigen::Vector3d off = frame.force / frame.ticks - gave;
    const double kept = std::exp(-duration / kMemory);
    error.all = kept * error.all + off.squaredNorm();
    error.left = kept * error.left + (off - ways * error.perWay).squaredNorm();
    const double foretold = error.all > 0 ? std::max(0.0, 1 - error.left / error.all) : 0;
    error.moments = kept * error.moments + ways.transpose() * ways;
    error.answers = kept * error.answers + ways.transpose() * off;
    Eigen::Matrix2d ridged = error.moments;
    ridged.diagonal() *= 1 + kRidge;
    ridged.diagonal().array() += kLeast;
    error.perWay = ridged.inverse() * error.answers;
    const double former = std::exp(-duration / kGentle);
    const Eigen::Vector2d known = former * error.known[0] + (1 - former) * foretold * error.perWay;
    error.known = {{known, error.known[0]}};
  }
  error.frames = {{{}, error.frames[0]}};
}

}  // namespace medulla
