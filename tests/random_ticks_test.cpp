#include <cstdlib>

#include "tests/proxy_run.h"

// Random bodies, deformations and tools: whatever happens, the proxy stays outside and every number finite.
namespace medulla {

using Eigen::Vector3d;

namespace {

// Two waves and a swing; steeper waves would turn the surface inside out, which no body of the dynamics does.
struct RandomMotion {
  Vector3d wave[2], direction[2], swing, offset;
  double phase[2], rate[2], swingRate;

  RandomMotion(TestRandom& random, const Vector3d& place) : offset(place) {
    for (int k = 0; k < 2; ++k) {
      wave[k] = random.vector(50);                                                          // rad/m
      direction[k] = random.uniform(0, 0.15) / (10 + wave[k].norm()) * random.vector(1.5);  // m
      phase[k] = random.uniform(0, 6);
      rate[k] = random.uniform(0, 40);  // rad/s
    }
    swing = random.vector(random.uniform(0, 0.012));
    swingRate = random.uniform(0, 30);
  }
  Vector3d operator()(const Vector3d& x, double t) const {
    Vector3d y = x + offset + std::sin(swingRate * t) * swing;
    for (int k = 0; k < 2; ++k) y += std::sin(wave[k].dot(x) + rate[k] * t + phase[k]) * direction[k];
    return y;
  }
};

// Goes from place to place at up to 5 m/s, rests, jumps now and then, and closes its grip.
struct RandomDevice {
  TestRandom* random;
  Vector3d position, goal;
  double speed = 0, grip = 0;

  explicit RandomDevice(TestRandom& r) : random(&r), position(r.vector(0.12)), goal(position) {}
  ToolSample next() {
    const Vector3d way = goal - position;
    const double step = speed * tickDuration;
    if (way.norm() <= step || random->uniform() < 0.002) {
      goal = random->vector(0.09);
      speed = 5 * std::pow(random->uniform(), 3);
      if (random->uniform() < 0.1) position = random->vector(0.3);
      grip = random->uniform() < 0.2 ? 1 : 0;
    } else {
      position += step * way.normalized();
    }
    return deviceAt(position, grip);
  }
};

}  // namespace

static TouchShape randomShape(TestRandom& random) {
  const double kind = random.uniform();
  const int buckets = 1 + int(random.uniform(0, 12));
  if (kind < 0.3) return plate(3 + int(random.uniform(0, 5)), 0.05, random.uniform(0.0005, 0.02), buckets);
  return ellipsoid(5 + int(random.uniform(0, 14)), 4 + int(random.uniform(0, 10)), buckets, kind < 0.6 ? 1 : 0.2);
}

static ToolSettings randomTool(TestRandom& random) {
  ToolSettings tool;
  tool.radius = 1e-5 * std::pow(400, random.uniform());  // 0.01 to 4 mm
  tool.stiffness = random.uniform(100, 2000);
  tool.damping = random.uniform(0, 3);
  tool.dynamicFriction = random.uniform(0, 0.6);
  tool.staticFriction = tool.dynamicFriction + random.uniform(0, 0.3);
  return tool;
}

static DynamicsFrame frameOf(const std::vector<TouchShape>& shapes, const std::vector<RandomMotion>& motions,
                             double t) {
  DynamicsFrame frame;
  frame.time = t;
  for (std::size_t b = 0; b < shapes.size(); ++b) frame.bodies.push_back(frameAt(*shapes[b], t, motions[b]).bodies[0]);
  return frame;
}

// One body or two beside each other, two tools. Returns how many ticks had contact.
static int runEpisode(std::uint64_t seed, int frames) {
  TestRandom random{seed * 0x9E3779B97F4A7C15ULL + 1};
  const std::size_t bodies = random.uniform() < 0.7 ? 1 : 2;
  std::vector<TouchShape> shapes;
  std::vector<RandomMotion> motions;
  for (std::size_t b = 0; b < bodies; ++b) {
    shapes.push_back(randomShape(random));
    motions.emplace_back(random, Vector3d(0, 0, bodies == 1 ? 0 : b == 0 ? -0.075 : 0.075));
  }
  std::vector<TouchableBody> touchable;
  touchable.reserve(bodies);
  for (const TouchShape& shape : shapes)
    touchable.push_back(
        {shape, std::vector<NodeGive>(shape->restNodes.size(), {seed % 2 == 0 ? 0 : 0.05, seed % 4 < 2 ? 0 : 0.1})});
  const std::vector<ToolSettings> tools = {randomTool(random), randomTool(random)};
  RandomDevice devices[2] = {RandomDevice(random), RandomDevice(random)};
  const int ticksPerFrame = std::array<int, 4>{50, 20, 10, 1}[int(random.uniform(0, 4))];
  DynamicsFrame from = frameOf(shapes, motions, 0), to = from;
  Servo servo(touchable, tools, tickDuration, from, {devices[0].next(), devices[1].next()});
  BlendedSurface seen[2];
  int contacts = 0;
  for (int frame = 0; frame < frames * 20 / ticksPerFrame; ++frame) {
    for (int k = 1; k <= ticksPerFrame; ++k) {
      const double alpha = double(k) / ticksPerFrame;
      servo.tick(alpha, {devices[0].next(), devices[1].next()});
      for (std::size_t i = 0; i < tools.size(); ++i) {
        const ToolState& tool = servo.tools()[i];
        EXPECT_TRUE(tool.proxy.allFinite() && tool.force.allFinite() && std::isfinite(tool.energy)) << "seed " << seed;
        EXPECT_LE(tool.force.norm(), tools[i].forceMax * (1 + 1e-12)) << "seed " << seed;
        contacts += tool.inContact;
        if ((frame * ticksPerFrame + k) % 10 != 0) continue;
        for (std::size_t b = 0; b < bodies; ++b) {
          seen[b].triangles = shapes[b]->triangles;
          seen[b].from = from.bodies[b].nodes;
          seen[b].to = to.bodies[b].nodes;
          EXPECT_FALSE(isInside(seen[b], alpha, tool.proxy))
              << "seed " << seed << ", tick " << frame * ticksPerFrame + k << ", tool " << i;
        }
      }
      if (::testing::Test::HasFailure()) return contacts;
    }
    from = to;
    to = frameOf(shapes, motions, (frame + 1) * ticksPerFrame * tickDuration);
    servo.commit(from, to, servo.tools());
    servo.beginFrame();
  }
  return contacts;
}

// MEDULLA_RANDOM_TICKS sets how many ticks of a tool there are.
TEST(RandomTicks, NeverFallThroughAndStayFinite) {
  const char* wanted = std::getenv("MEDULLA_RANDOM_TICKS");
  const long ticks = wanted != nullptr ? std::atol(wanted) : 200000;
  constexpr int frames = 50, ticksPerEpisode = 2 * 20 * frames;
  long contacts = 0;
  for (long episode = 0; episode * ticksPerEpisode < ticks && !HasFailure(); ++episode)
    contacts += runEpisode(std::uint64_t(episode), frames);
  EXPECT_GT(contacts, ticks / 10);
}

}  // namespace medulla
