#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "haptics/buckets.h"
#include "haptics/tool_input.h"
#include "physics/dynamics/frame.h"
#include "physics/dynamics/loads.h"
#include "physics/model/soft_body_model.h"

// The haptic side of a run (paper 4 and 5): proxies of all tools against the blended surfaces of all bodies, at the
// servo rate. The servo reads two dynamics frames and never changes them; the dynamics reads what the servo hands over
// at the end of a dynamics frame.
//
// One dynamics frame of a run:  beginFrame, tick x N (alpha = 1/N .. 1), handOver | World::advance, commit.
// What stands before the bar is the servo's side, what stands behind it the dynamics' side. In logical time both run in
// turns; live each runs in a thread of its own, and commit() passes surfaces on through a TripleBuffer.
namespace medulla {

struct ToolState {
  Eigen::Vector3d device = Eigen::Vector3d::Zero();  // m
  // m, centre of the proxy sphere; while holding it rides on the held patch
  Eigen::Vector3d proxy = Eigen::Vector3d::Zero();
  // N, on the hand, clamped: stiffness (proxy + its shading - device) + damping, the push kept to what the tissue gave;
  // while holding, the sum of the held nodes' springs, kept likewise
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  bool inContact = false;
  bool holding = false;
  bool clamped = false;  // forceMax was reached
  bool slipped = false;  // what the closed grip held has torn away
  // Surfaces on all sides leave its proxy less than half of its radius. Tissue that closes around a tool does so, where
  // it is pressed deeper than its model can follow.
  bool squeezed = false;
  // For pictures, in which nothing of a tool jumps: the force as it was over the last hundredths of a second, N, and
  // how far a grip has taken hold, 0 to 1.
  Eigen::Vector3d steadyForce = Eigen::Vector3d::Zero();
  double grasp = 0;
  // J, handed to the user since the start: the force of each tick over the device's way to the next. What a grip turns
  // does work, too, but the hand gets no moment.
  double energy = 0;
};

class Servo {
 public:
  // One bucket scene per filling sphere of every body; body k of a frame is bodies[k]. `rest` is the first frame. A
  // tool that starts inside of a body gets a proxy at the nearest point outside. Throws std::runtime_error when Embree
  // cannot start, or naming the tool whose settings or start are out of range.
  Servo(const std::vector<TouchableBody>& bodies, const std::vector<ToolSettings>& tools, double tickDuration,
        const DynamicsFrame& rest, const std::vector<ToolSample>& start, const EmbreeSettings& embree = {});
  ~Servo();
  Servo(const Servo&) = delete;
  Servo& operator=(const Servo&) = delete;

  // Dynamics' side, after each dynamics frame: the two frames to blend next, `from` being the `to` of the last commit.
  // `tools` is about where the tools are: Embree's bounds are renewed near them. `toolImpulse` is what they gave in
  // this frame (World::advance(), N s); null: not known, and no force is kept to it. It answers what tools did
  // `framesLate` frames earlier than in logical time. Contents are copied.
  void commit(const DynamicsFrame& from, const DynamicsFrame& to, const std::vector<ToolState>& tools,
              const std::vector<Eigen::Vector3d>* toolImpulse = nullptr, int framesLate = 0);

  // The rest is the servo's side; none of it allocates or locks.

  // Begins to blend what was committed last, once alpha has reached 1. False when nothing new has come: the surface
  // then stays where it is, and further ticks are at alpha 1.
  bool beginFrame();

  // One servo tick at the blend alpha (0..1], not falling within a frame, for one sample per tool. Throws
  // std::runtime_error naming the tool whose device is not finite or beyond kToolReach, whose quaternion is not unit
  // within 1e-3 or whose grip is not finite, and NotFinite where a surface carries a tool beyond kToolReach.
  void tick(double alpha, const std::vector<ToolSample>& inputs);

  const std::vector<ToolState>& tools() const;

  // The springs that stand for the tools' contacts and grips during the next dynamics frame of `frameDuration` s.
  // `out` is cleared and filled; nothing is allocated after makeRoom().
  void handOver(double frameDuration, Loads& out);
  void makeRoom(Loads& out) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace medulla
