#include "app/live_servo.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>

#include "app/files/trajectory_file.h"
#include "haptics/triple_buffer.h"
#include "tests/program_run.h"
#include "tests/temporary_folder.h"

namespace medulla {

static LoadedScene gallbladder(double duration) {
  const std::string path = std::string(MEDULLA_SOURCE_DIR) + "/scenes/gallbladder.xml";
  return loadScene(readScene(path, {{"clock.duration", std::to_string(duration)}}));
}

TEST(TripleBuffer, TheReaderSeesWholeStatesInOrderAndTheLastOne) {
  constexpr int count = 200000;
  using State = std::array<int, 64>;
  TripleBuffer<State> buffer;
  std::thread writer([&] {
    for (int n = 1; n <= count; ++n) {
      buffer.writing().fill(n);
      buffer.publish();
    }
  });
  int last = 0;
  while (last < count) {
    if (!buffer.take()) continue;
    const State& state = buffer.reading();
    ASSERT_GT(state[0], last);
    last = state[0];
    for (const int n : state) ASSERT_EQ(n, last);
  }
  writer.join();
  EXPECT_FALSE(buffer.take());
  EXPECT_EQ(buffer.reading()[0], count);
}

// Twice as fast as it was recorded: what a test can wait for, and contact within it.
TEST(LiveServo, RunsAgainstTheClockAndFeelsContact) {
  LoadedScene loaded = gallbladder(1.5);
  for (ToolSample& sample : loaded.trajectories[0].samples) sample.time *= 0.5;
  Simulation simulation(loaded);
  LiveServo live(simulation);
  while (!simulation.finished()) {
    live.advanceFrame();
    for (const ToolState& tool : simulation.record().tools.back())
      ASSERT_TRUE(tool.proxy.allFinite() && tool.force.allFinite());
  }
  const LiveReport report = live.stop();
  EXPECT_GE(report.ticks, (simulation.frame() - 1) * simulation.ticksPerFrame());
  EXPECT_GT(simulation.totals().forceMax, 0.05);
  EXPECT_GT(report.cpuMedian, 0);
  EXPECT_LE(report.cpuMedian, report.cpu999);
  EXPECT_LE(report.cpu999, report.cpuMax);
}

TEST(LiveServo, TicksFromTheFirstFrameToTheLast) {
  const auto pause = [] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); };
  const LoadedScene loaded = gallbladder(0.1);
  Simulation simulation(loaded), unused(loaded);
  LiveServo live(simulation), waiting(unused);
  pause();
  EXPECT_EQ(waiting.stop().ticks, 0);
  while (!simulation.finished()) live.advanceFrame();
  const long ticks = live.stop().ticks;
  EXPECT_GE(ticks, (simulation.frame() - 1) * simulation.ticksPerFrame());
  pause();
  EXPECT_EQ(live.stop().ticks, ticks);
}

TEST(LiveServo, WhatTheServoRefusesReachesTheCaller) {
  LoadedScene loaded = gallbladder(1);
  ToolSample lost = loaded.trajectories[0].samples.front();
  lost.time = 0.1;
  lost.position.x() = 1.5 * kToolReach;
  loaded.trajectories[0].samples = {loaded.trajectories[0].samples.front(), lost};
  Simulation simulation(loaded);
  LiveServo live(simulation);
  EXPECT_THROW(
      {
        while (!simulation.finished()) live.advanceFrame();
      },
      std::runtime_error);
}

static const std::string kScenes = std::string(MEDULLA_SOURCE_DIR) + "/scenes/";

TEST(RealtimeCommand, TellsTheServosTimes) {
  const ProgramResult run =
      runProgram({"replay", kScenes + "gallbladder.xml", "--set", "clock.duration=0.3", "--realtime"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  for (const char* name : {"servo_ticks", "servo_cpu_p50", "servo_cpu_p99.9", "servo_cpu_max", "servo_late",
                           "servo_latest", "surface_stood", "hash"})
    EXPECT_NE(("\n" + run.out).find(std::string("\n") + name + " "), std::string::npos) << name << " in\n" << run.out;
}

TEST(RealtimeCommand, AlsoOfASceneWithoutTools) {
  const ProgramResult run =
      runProgram({"replay", kScenes + "dolphin.xml", "--set", "clock.duration=0.2", "--realtime"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(valueOf(run.out, "simulated"), "0.2 s");
  EXPECT_EQ(valueOf(run.out, "servo_ticks"), "5");
}

// The rest that the servo hands over before the motion begins is no part of it.
TEST(RealtimeCommand, WhatItRecordsAndLogsBeginsWithTheMotion) {
  const TemporaryFolder folder;
  const std::string hand = folder / "hand.csv", log = folder / "run.csv", times = folder / "times.csv";
  const ProgramResult run =
      runProgram({"replay", kScenes + "gallbladder.xml", "--set", "clock.duration=0.3", "--realtime", "--record", hand,
                  "--log", log, "--log-rate", "tick", "--frame-times", times});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const Trajectory recorded = readTrajectory(hand);
  EXPECT_EQ(recorded.samples.front().time, 0);
  EXPECT_NEAR(recorded.samples[1].time, 1 / 1200.0, 1e-9);
  const std::string rows = readFile(log), first = rows.substr(rows.find('\n') + 1, 20);
  EXPECT_GT(std::stod(first), 0) << first;
  std::istringstream frames(readFile(times));
  std::string frame;
  for (int k = 0; k < 2; ++k) std::getline(frames, frame);  // names, and the rest handed over before the first tick
  for (int k = 0; k < 14; ++k) {
    std::getline(frames, frame);
    EXPECT_GT(std::stod(frame.substr(frame.find(',') + 1)), 0) << frame;  // what the servo took, elsewhere
  }
}

// ---- Embree ----------------------------------------------------------------------------------------------

static std::uint64_t hashUnder(const LoadedScene& loaded, const EmbreeSettings& embree) {
  Simulation simulation(loaded, embree);
  while (!simulation.finished()) simulation.advanceFrame();
  EXPECT_GT(simulation.totals().forceMax, 0.05);
  return simulation.world().stateHash();
}

TEST(Embree, InstructionSetAndThreadsLeaveTheHashAlone) {
  const LoadedScene loaded = gallbladder(5);  // approach, press, grab and pull
  const std::uint64_t hash = hashUnder(loaded, {});
  for (const char* isa : {"sse2", "sse4.2", "avx", "avx2", "avx512"}) {
    if (!isEmbreeIsa(isa)) continue;
    EXPECT_EQ(hashUnder(loaded, {isa, 1}), hash) << isa;
  }
  EXPECT_EQ(hashUnder(loaded, {"", 2}), hash);
  EXPECT_FALSE(isEmbreeIsa("mmx"));
}

}  // namespace medulla
