#pragma once

#include <functional>

#include "haptics/servo.h"
#include "tests/spring_body.h"

namespace medulla {

// One tool against one soft stand-in, as a simulation runs them: ticks, hand-over, dynamics, commit.
struct ToolRun {
  SpringBody body;
  ToolSettings tool;
  std::function<ToolSample(double time)> device;
  int ticksPerFrame = 24;
  double tickDuration = 1.0 / 1200;

  Loads loads;                                            // last handed over
  Eigen::Vector3d handImpulse = Eigen::Vector3d::Zero();  // N s, of the force on the hand, turned round
  Eigen::Vector3d bodyImpulse = Eigen::Vector3d::Zero();  // N s, that the dynamics took
  double bodyImpulseLength = 0;                           // N s, sum over frames of its size
  bool blend = true;                                      // false: every tick at the newest frame
  std::vector<NodeGive> give{};                           // TouchableBody::give
  bool live = false;                                      // what was handed over waits for a frame
  int substeps = 200;                                     // of the body, per frame

  void run(double duration, const std::function<void(double time, const ToolState&)>& each = {}) {
    const double frameDuration = ticksPerFrame * tickDuration;
    DynamicsFrame last = body.frame(), now = last;
    Loads earlier;
    Servo servo({{body.shape, give}}, {tool}, tickDuration, now, {device(0)});
    const int frames = int(std::lround(duration / frameDuration));
    for (int frame = 0; frame < frames; ++frame) {
      for (int k = 1; k <= ticksPerFrame; ++k) {
        const double time = (frame * ticksPerFrame + k) * tickDuration;
        servo.tick(blend ? double(k) / ticksPerFrame : 1, {device(time)});
        handImpulse -= tickDuration * servo.tools()[0].force;
        if (each) each(time, servo.tools()[0]);
      }
      servo.handOver(frameDuration, loads);
      const Eigen::Vector3d impulse = body.advance(live ? earlier : loads, frameDuration, substeps);
      earlier = loads;
      bodyImpulse += impulse;
      bodyImpulseLength += impulse.norm();
      last = now;
      now = body.frame();
      const std::vector<Eigen::Vector3d> impulses{impulse};
      servo.commit(last, now, servo.tools(), &impulses, live ? 1 : 0);
      servo.beginFrame();
    }
  }
  double mismatch() const { return (handImpulse - bodyImpulse).norm() / bodyImpulseLength; }
};

inline ToolSample deviceAt(const Eigen::Vector3d& position, double grip = 0) {
  ToolSample sample;
  sample.position = position;
  sample.grip = grip;
  return sample;
}

// 0 before `start`, 1 after `start + duration`, smooth between.
inline double ease(double time, double start, double duration) {
  const double s = std::clamp((time - start) / duration, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

}  // namespace medulla
