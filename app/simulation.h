#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "app/files/reference_file.h"
#include "app/scene.h"
#include "haptics/servo.h"
#include "physics/dynamics/world.h"
#include "physics/model/triangle_mesh.h"

namespace medulla {

// A scene with everything that it names in memory; its bodies have their models.
struct LoadedScene {
  Scene scene;
  std::vector<TriangleMesh> statics;     // one per static, in its frame; what is drawn
  std::vector<Trajectory> trajectories;  // one per tool
  std::vector<Reference> references;     // one per body; without displacements where none is named
};

// `trajectories` replaces files of the scene's tools, by tool name. Throws std::runtime_error with file and line; a
// file that is missing is reported at the scene's line that names it.
LoadedScene loadScene(Scene scene, const std::map<std::string, std::string>& trajectories = {});

double sizeOfBodies(const Scene& scene);  // m: the diagonal of the box around all of them at rest

// The scene's bodies before they settle, ahead of time 0. Throws std::runtime_error naming the body that cannot be
// simulated.
World makeWorld(const LoadedScene& loaded);

// What the servo saw and did during one dynamics frame [start, start + duration]: the two frames that were blended
// meanwhile (not recorded live), inputs and tools at its ticks (index 0 is the state at `start`), and what the dynamics
// was handed at its end.
struct ServoRecord {
  double start = 0, duration = 0;  // s
  DynamicsFrame from, to;
  std::vector<std::vector<ToolSample>> inputs;
  std::vector<std::vector<ToolState>> tools;
  Loads loads;
  double seconds = 0;  // what its ticks took
};

// s by the clock: what the last dynamics frame took, and nothing that a run depends on.
struct FrameTimes {
  double servo = 0;     // its ticks; of a servo that runs elsewhere, processor time
  double dynamics = 0;  // its substeps
  double surface = 0;   // the moved surface made ready for the next ticks
};

// The state that a picture shows.
struct PictureState {
  double time = 0;  // s
  DynamicsFrame frame;
  std::vector<ToolSample> inputs;
  std::vector<ToolState> tools;
};

// State at a time within the record: surface, device and proxy blended between ticks. `out` is reused.
void stateAt(const ServoRecord& record, double time, PictureState& out);

// %, of impulses in N s; of what is no more than rounding, 0.
inline double mismatchOf(double difference, double impulse) {
  constexpr double kRounding = 1e-9;
  return impulse > kRounding ? 100 * difference / impulse : 0;
}

// Results of a run so far.
struct RunTotals {
  double simulated = 0;  // s
  long substeps = 0, ticks = 0;
  double forceMax = 0;                            // N, of any tool
  double volumeRatioMin = 1, volumeRatioMax = 1;  // of any body
  long clampedTicks = 0, gripSlips = 0;           // of all tools
  std::vector<bool> touched, held;                // has tool k been in contact or held anything; has it held anything
  std::vector<bool> pressed;                      // has any tool acted on body b
  std::vector<int> closings;                      // how often tool k's grip has closed since it began
  std::vector<bool> beganClosed;                  // was it closed then
  std::vector<long> squeezedTicks;                // of tool k
  double userEnergyMax = 0;                       // J, the most that any tool had handed to the user
  double toolImpulse = 0, impulseDifference = 0;  // N s, sums over frames and tools of lengths
  double impulseMismatch() const { return mismatchOf(impulseDifference, toolImpulse); }
};

// The loop of a run in logical time: ticks of the servo over the two last dynamics frames, then one dynamics frame
// under the springs that the servo hands over (paper 5). No thread, and a clock only to tell what took how long: the
// same scene gives the same hash.
class Simulation {
 public:
  // With the bodies settled, at time 0. Throws what makeWorld() and World::advance() throw, and Interrupted.
  explicit Simulation(const LoadedScene& loaded, const EmbreeSettings& embree = {});

  // Whatever has been reached, too, when a servo's clock has passed the scene's duration.
  bool finished() const;
  // Both throw NotFinite when the state stops being finite. The second is the dynamics' half alone, after what
  // a servo that runs elsewhere has recorded.
  void advanceFrame();
  void advanceFrame(const ServoRecord& servo);

  // For a servo that runs elsewhere.
  Servo& servo() const { return *servo_; }
  int ticksPerFrame() const { return ticksPerFrame_; }
  double tickDuration() const { return tickDuration_; }
  void sampleInputs(double time, std::vector<ToolSample>& out) const;  // of every tool

  int frame() const { return frame_; }  // dynamics frames done
  double time() const { return frame_ * frameDuration_; }
  const FrameTimes& times() const { return times_; }
  const ServoRecord& record() const { return record_; }        // of the last frame; before the first: the rest state
  const DynamicsFrame& previous() const { return previous_; }  // dynamics frames, not delayed by blending
  const DynamicsFrame& current() const { return current_; }
  double lastImpulseMismatch() const { return lastMismatch_; }  // %, of the last frame
  const RunTotals& totals() const { return totals_; }
  const World& world() const { return world_; }

 private:
  void settle();  // until the first frame at time 0
  void beginAtRest();
  void runTicks();
  void advanceDynamics();
  void accountTicks();
  void accountImpulses(const std::vector<Eigen::Vector3d>& given);
  void accountVolumes();

  const LoadedScene* loaded_;
  int ticksPerFrame_, frameCount_, frame_ = 0;
  double frameDuration_, tickDuration_;
  World world_;
  DynamicsFrame previous_, current_;
  std::vector<ToolSample> inputs_;
  std::unique_ptr<Servo> servo_;
  ServoRecord record_;
  bool isAwaited_ = false;  // by a servo that runs elsewhere
  FrameTimes times_;
  RunTotals totals_;
  double lastMismatch_ = 0;
};

}  // namespace medulla
