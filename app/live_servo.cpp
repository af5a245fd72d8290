#include "app/live_servo.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <exception>
#include <thread>

#include "app/interrupt.h"
#include "haptics/triple_buffer.h"
#include "render/stage_times.h"

namespace medulla {

using Clock = std::chrono::steady_clock;

namespace {

// Times of ticks in bins of 0.1 us, the last for all beyond 1 ms: a fixed size, because the servo allocates nothing.
struct TickTimes {
  static constexpr int bins = 10001;
  static constexpr double width = 1e-7;  // s
  std::array<std::atomic<int>, bins> count{};
  std::atomic<double> longest{0};

  void add(double seconds) {
    const int bin = std::clamp(static_cast<int>(seconds / width), 0, bins - 1);
    count[bin].fetch_add(1, std::memory_order_relaxed);
    if (seconds > longest) longest = seconds;
  }
  // The upper end of the bin in which that share of the times is reached, but no more than the longest.
  double quantile(double share) const {
    long total = 0, sum = 0;
    for (const std::atomic<int>& c : count) total += c;
    for (int bin = 0; bin + 1 < bins; ++bin) {
      sum += count[bin];
      if (static_cast<double>(sum) >= share * static_cast<double>(total))
        return std::min(width * (bin + 1), longest.load());
    }
    return longest;
  }
};

}  // namespace

struct LiveServo::Data {
  Simulation& simulation;
  TripleBuffer<ServoRecord> handedOver;  // to the dynamics
  TickTimes cpu;
  std::atomic<long> ticks{0}, lateTicks{0}, standingTicks{0};
  std::atomic<double> latest{0};  // s
  std::atomic<bool> stopped{false}, failed{false};
  std::exception_ptr failure;  // written before `failed`
  std::thread thread;

  explicit Data(Simulation& s);
  void start();
  void stop();
  void run();
  void noteLateness(Clock::time_point deadline);
};

static Clock::duration toDuration(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

// All that a frame can bring: the servo's thread allocates nothing.
static ServoRecord emptyRecord(const Simulation& simulation) {
  ServoRecord record = simulation.record();
  record.from = record.to = {};
  simulation.servo().makeRoom(record.loads);
  return record;
}

// The dynamics begins at once, with the state at rest handed over: from then on it is one frame ahead.
LiveServo::Data::Data(Simulation& s) : simulation(s), handedOver({emptyRecord(s), emptyRecord(s), emptyRecord(s)}) {
  handedOver.writing().start = -s.record().duration;
  handedOver.publish();
}

void LiveServo::Data::start() {
  thread = std::thread([this] {
    try {
      run();
    } catch (...) {
      failure = std::current_exception();
      failed = true;
    }
  });
}

void LiveServo::Data::stop() {
  stopped = true;
  if (thread.joinable()) thread.join();
}

void LiveServo::Data::noteLateness(Clock::time_point deadline) {
  const double lateness = std::chrono::duration<double>(Clock::now() - deadline).count();
  if (lateness > simulation.tickDuration()) ++lateTicks;
  if (lateness > latest) latest = lateness;
}

void LiveServo::Data::run() {
  Servo& servo = simulation.servo();
  const int ticksPerFrame = simulation.ticksPerFrame();
  std::vector<ToolSample> inputs;
  simulation.sampleInputs(0, inputs);
  const Clock::time_point begin = Clock::now();
  int within = 0;  // tick of the frame; the first blends from rest to rest
  for (long tick = 1;; ++tick) {
    const double time = static_cast<double>(tick) * simulation.tickDuration();
    const Clock::time_point deadline = begin + toDuration(time);
    std::this_thread::sleep_until(deadline);
    if (stopped) return;
    noteLateness(deadline);
    const double before = threadCpuSeconds();
    if (within == ticksPerFrame && servo.beginFrame()) {
      handedOver.publish();  // not before, or a fast dynamics' surface would take the place of one that still waits
      within = 0;
    }
    const bool stands = within == ticksPerFrame;
    standingTicks += stands;
    ServoRecord& record = handedOver.writing();
    if (within == 0) {
      record.start = time - simulation.tickDuration();
      record.inputs[0] = inputs;
      record.tools[0] = servo.tools();
      record.seconds = 0;
    }
    if (!stands) ++within;
    simulation.sampleInputs(time, inputs);
    servo.tick(static_cast<double>(within) / ticksPerFrame, inputs);
    if (!stands) {
      record.inputs[within] = inputs;
      record.tools[within] = servo.tools();
      if (within == ticksPerFrame) servo.handOver(record.duration, record.loads);
    }
    const double taken = threadCpuSeconds() - before;
    record.seconds += taken;
    cpu.add(taken);
    ++ticks;
  }
}

LiveServo::LiveServo(Simulation& simulation) : data_(std::make_unique<Data>(simulation)) {}

LiveServo::~LiveServo() {
  data_->stop();
}

void LiveServo::advanceFrame() {
  if (!data_->thread.joinable()) data_->start();
  constexpr auto pause = std::chrono::microseconds(100);  // of frames of 20 ms; a signal would cost the servo a lock
  while (!data_->handedOver.take()) {
    if (data_->failed) std::rethrow_exception(data_->failure);
    checkInterrupt();
    std::this_thread::sleep_for(pause);
  }
  data_->simulation.advanceFrame(data_->handedOver.reading());
}

LiveReport LiveServo::stop() {
  data_->stop();
  const Data& d = *data_;
  return {d.ticks, d.lateTicks, d.standingTicks, d.latest, d.cpu.quantile(0.5), d.cpu.quantile(0.999), d.cpu.longest};
}

}  // namespace medulla
