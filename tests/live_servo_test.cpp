#include "app/live_servo.h"

#include <gtest/gtest.h>

#include <array>
#include <thread>

#include "haptics/triple_buffer.h"

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
  const LiveReport report = live.report();
  EXPECT_GE(report.ticks, (simulation.frameCount() - 1) * simulation.ticksPerFrame());
  EXPECT_GT(simulation.totals().forceMax, 0.05);
  EXPECT_GT(report.cpuMedian, 0);
  EXPECT_LE(report.cpuMedian, report.cpu999);
}

TEST(LiveServo, WhatTheServoRefusesReachesTheCaller) {
  LoadedScene loaded = gallbladder(1);
  ToolSample lost = loaded.trajectories[0].samples.front();
  lost.time = 0.1;
  lost.position.x() = 1.5 * toolReach;
  loaded.trajectories[0].samples = {loaded.trajectories[0].samples.front(), lost};
  Simulation simulation(loaded);
  LiveServo live(simulation);
  EXPECT_THROW(
      {
        while (!simulation.finished()) live.advanceFrame();
      },
      std::runtime_error);
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
