#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/contact_bodies.h"
#include "tests/identified_model.h"
#include "tests/synthetic_model.h"
#include "tests/tool_run.h"

// Counts what this program asks of operator new; sanitizers bring their own, which g++ and clang tell each their way.
#if !defined(__has_feature)
#define __has_feature(x) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || __has_feature(address_sanitizer) || \
    __has_feature(thread_sanitizer)
#define MEDULLA_COUNTS_ALLOCATIONS 0
#else
#define MEDULLA_COUNTS_ALLOCATIONS 1
#endif

static std::atomic<long> allocations{0};

#if MEDULLA_COUNTS_ALLOCATIONS
// Not inlined: g++ takes a free() that it sees beside a new that it does not for a mistake.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size == 0 ? 1 : size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto a = static_cast<std::size_t>(alignment);
  if (void* p = std::aligned_alloc(a, std::max<std::size_t>(1, (size + a - 1) / a) * a)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
#endif

namespace medulla {

// Press, grab, pull until it slips, let go, jump: with frames taken in between, as the live servo does.
TEST(Servo, AllocatesNothingOnItsSide) {
  if (!MEDULLA_COUNTS_ALLOCATIONS) GTEST_SKIP() << "a sanitizer has operator new";
  SpringBody body(ellipsoid(24, 20, 7, 0.3));
  ToolSettings tool;
  tool.gripForceMax = 0.5;
  const auto device = [](double t) {
    if (t > 1.2) return deviceAt({0.5, 0.5, 0.5});
    const double down = 0.006 * ease(t, 0, 0.2), up = 0.05 * ease(t, 0.4, 0.5);
    return deviceAt({0.012, 0.004, 0.0545 - down + up}, t > 0.3 && t < 1.1 ? 1 : 0);
  };
  DynamicsFrame last = body.frame(), now = last;
  Servo servo({{body.shape}}, {tool}, 1e-3, now, {device(0)});
  Loads loads;
  servo.makeRoom(loads);
  std::vector<ToolSample> input(1);
  long allocated = 0;
  bool contact = false, held = false, slipped = false;
  for (int frame = 0; frame < 70; ++frame) {
    const long before = allocations;
    servo.beginFrame();
    for (int k = 1; k <= 20; ++k) {
      input[0] = device(1e-3 * (20 * frame + k));
      servo.tick(k / 20.0, input);
      contact = contact || servo.tools()[0].inContact;
      held = held || servo.tools()[0].holding;
      slipped = slipped || servo.tools()[0].slipped;
    }
    servo.handOver(0.02, loads);
    allocated += allocations - before;
    const std::vector<Eigen::Vector3d> impulses{body.advance(loads, 0.02, 200)};
    last = now;
    now = body.frame();
    servo.commit(last, now, servo.tools(), &impulses);
  }
  EXPECT_TRUE(contact && held && slipped);
  EXPECT_EQ(allocated, 0);
}

namespace {

BodyDescription loadedTube() {
  BodyDescription tube = synthetic::body(synthetic::chainModel(synthetic::straightTube(4, 0.06, 0.012, 8, 10)), 5e3);
  tube.surface = SurfaceMode::contact;
  return tube;
}
BodyDescription loadedSkin() {
  BodyDescription skin = synthetic::identifiedBody(synthetic::withNetwork(*loadedTube().model), 5e3);
  skin.surface = SurfaceMode::skin;
  skin.deadLoads = {{30, {0, 0, 0.001}, 0, 0}};
  return skin;
}

// In a frame of so many substeps: a tube that a tool holds lies on the floor under a ball.
long allocationsInFrame(BodyDescription tube, Integrator integrator, int substeps) {
  WorldSettings settings;
  settings.integrator = integrator;
  settings.contact = ContactMode::balls;
  settings.gravity = {0, -9.81, 0};
  settings.substeps = substeps;
  settings.sleepAfter = 0;
  tube.name = "tube";
  tube.worldFromModel.translation() = Eigen::Vector3d(0, 0.0125, 0);
  tube.tissue.damping = 0.5;
  World world(settings, {tube, synthetic::ball("ball", 0.01, {0.03, 0.035, 0})}, {StaticShape{}});
  Loads loads;
  loads.heldNodes.resize(1);
  loads.heldNodes[0].node = 20;
  loads.heldNodes[0].anchor = tube.worldFromModel * tube.model->restNodes[20];
  loads.heldNodes[0].stiffness = 5;
  loads.heldNodes[0].damping = 0.05;
  // Until lists have been as long as they get.
  for (int k = 0; k < 180; ++k) world.advance(loads);
  const long before = allocations;
  world.advance(loads);
  return allocations - before;
}

}  // namespace

TEST(World, ASubstepAllocatesNothing) {
  if (!MEDULLA_COUNTS_ALLOCATIONS) GTEST_SKIP() << "a sanitizer has operator new";
  for (const BodyDescription& tube : {loadedTube(), loadedSkin()}) {
    const auto inFrame = [&](Integrator integrator, int substeps) {
      return allocationsInFrame(tube, integrator, substeps);
    };
    EXPECT_EQ(inFrame(Integrator::explicitEuler, 20), inFrame(Integrator::explicitEuler, 40));
    EXPECT_EQ(inFrame(Integrator::implicit, 4), inFrame(Integrator::implicit, 8));
  }
}

}  // namespace medulla
