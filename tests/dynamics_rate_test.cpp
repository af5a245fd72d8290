#include <gtest/gtest.h>

#include "app/simulation.h"

// What a tool feels does not hang on the length of the dynamics' frames.
namespace medulla {

using Eigen::Vector3d;

// The first tool's force at each of `times` (s), N.
static std::vector<Vector3d> forcesAt(const std::vector<double>& times, const std::string& scene, const char* rate) {
  const LoadedScene loaded =
      loadScene(readScene(std::string(MEDULLA_SOURCE_DIR "/scenes/") + scene + ".xml", {{"clock.dynamics", rate}}));
  Simulation simulation(loaded);
  std::vector<Vector3d> out;
  for (const double time : times) {
    while (simulation.time() < time - 1e-9) simulation.advanceFrame();
    out.push_back(simulation.record().tools.back()[0].force);
  }
  return out;
}

// Pressed and held, pulled along the surface, gripped, pulled.
TEST(DynamicsRate, ForcesAreThoseOfShortFrames) {
  const std::vector<std::pair<const char*, std::vector<double>>> cases = {{"gallbladder", {2.8, 6.86, 8.5}},
                                                                          {"liver", {1.6, 3, 10.9, 16.9}}};
  for (const auto& [scene, times] : cases) {
    const std::vector<Vector3d> usual = forcesAt(times, scene, "50"), shorter = forcesAt(times, scene, "400");
    for (std::size_t k = 0; k < times.size(); ++k) {
      EXPECT_GT(shorter[k].norm(), 0.005);
      EXPECT_LT((usual[k] - shorter[k]).norm(), 0.15 * shorter[k].norm()) << scene << " at " << times[k] << " s";
    }
  }
}

}  // namespace medulla
