#pragma once

#include <Eigen/Core>
#include <array>

// What a hand that moves feels too much. Where touched or held tissue is by now is a guess, and of a motion that goes
// on it is off in the same way again and again: what a grip shakes goes round between the frames' ends, of which the
// hand sees the chords alone, felt as a mass of k T^2 / 12. A frame later the dynamics tells what the tissue gave. By
// how much the hand felt more is regressed on the device's way within a frame and on how that changed, so much damper
// and so much mass, and taken off as far as it has foretold the frames before: a motion that begins or ends is not what
// was learnt.
namespace medulla {

using WayAndChange = Eigen::Matrix<double, 3, 2>;  // m, in columns: within a frame up to now; less the one before that

struct MotionError {
  struct FeltFrame {  // sums over its ticks
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    WayAndChange ways = WayAndChange::Zero();
    int ticks = 0;
  };
  std::array<FeltFrame, 2> frames{};  // the present one, and the last
  // Sums over fading frames: of products of the ways (m2), and of these with what was felt too much (N m); of the
  // squares of that, and of what was left of it (N2).
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  Eigen::Vector2d answers = Eigen::Vector2d::Zero();
  double all = 0, left = 0;
  Eigen::Vector2d perWay = Eigen::Vector2d::Zero();  // N/m, as learnt
  // N/m, of that what has foretold enough, up to the surface's `to` and `from`.
  std::array<Eigen::Vector2d, 2> known{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

// N, of the force on the hand.
inline Eigen::Vector3d motionError(const WayAndChange& ways, double alpha, const MotionError& error) {
  return ways * ((1 - alpha) * error.known[1] + alpha * error.known[0]);
}
// `force`, N: on the hand at a tick, before the error is taken off.
void noteFelt(const Eigen::Vector3d& force, const WayAndChange& ways, MotionError& error);
// At the end of a frame of so many `ticks`, of which all have to be noted: what the tissue `gave`, N, in that frame or
// `framesLate` (0 or 1) before it. `duration`: s, of the frame.
void learnMotionError(const Eigen::Vector3d& gave, int ticks, int framesLate, double duration, MotionError& error);

}  // namespace medulla
