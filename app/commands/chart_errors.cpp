#include "app/commands/chart_errors.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace medulla {

namespace {

struct Deviation {
  double largest = 0, sum = 0;  // m, m2
  std::size_t count = 0;
  void add(double squared) {
    largest = std::max(largest, std::sqrt(squared));
    sum += squared;
    ++count;
  }
  double rms() const { return std::sqrt(sum / static_cast<double>(count)); }
};

Eigen::Vector3d restPlace(const LoadedScene& loaded, std::size_t body, std::size_t node) {
  return loaded.scene.bodies[body].worldFromModel * loaded.scene.bodies[body].model->restNodes[node];
}

void setDisplacement(const LoadedScene& loaded, ChartTruth& truth) {
  double squared = 0;
  for (const DynamicsFrame& frame : truth.moments)
    for (std::size_t b = 0; b < frame.bodies.size(); ++b)
      for (std::size_t i = 0; i < frame.bodies[b].nodes.size(); ++i)
        squared = std::max(squared, (frame.bodies[b].nodes[i] - restPlace(loaded, b, i)).squaredNorm());
  truth.displacement = std::sqrt(squared);
  constexpr double kLeast = 1e-9;  // m: less is rounding, and errors in % of it say nothing
  if (!(truth.displacement > kLeast)) throw std::runtime_error("nothing moves in this scene: no error can be stated");
}

// Per body and node: whether a dead load acts on it.
std::vector<std::vector<char>> loadedNodes(const LoadedScene& loaded) {
  std::vector<std::vector<char>> out;
  for (std::size_t b = 0; b < loaded.scene.bodies.size(); ++b) {
    out.emplace_back(loaded.scene.bodies[b].model->restNodes.size(), 0);
    for (const DeadLoad& load : loaded.scene.bodies[b].deadLoads) out.back()[load.node] = 1;
  }
  return out;
}

}  // namespace

bool namesReference(const LoadedScene& loaded) {
  return std::any_of(loaded.references.begin(), loaded.references.end(),
                     [](const Reference& r) { return !r.displacement.empty(); });
}

ChartTruth truthOfReferences(const LoadedScene& loaded) {
  ChartTruth truth;
  truth.cost = ChartCost::ofTheCase;
  DynamicsFrame& frame = truth.moments.emplace_back();
  for (std::size_t b = 0; b < loaded.scene.bodies.size(); ++b) {
    const Reference& reference = loaded.references[b];
    const std::size_t nodes = loaded.scene.bodies[b].model->restNodes.size();
    std::vector<char>& known = truth.known.emplace_back(nodes, 0);
    std::vector<Eigen::Vector3d>& place = frame.bodies.emplace_back().nodes;
    for (std::size_t i = 0; i < nodes; ++i) {
      place.push_back(restPlace(loaded, b, i));
      if (i >= reference.displacement.size() || !reference.displacement[i]) continue;
      known[i] = 1;
      place.back() += loaded.scene.bodies[b].worldFromModel.linear() * *reference.displacement[i];
    }
    for (const ReferenceRun& run : reference.runs) {
      ChartPoint& point = truth.ownRuns.emplace_back();
      point.curve = "FEM";
      point.nodes = run.nodes;
      point.cpu = run.cpu;
      point.errorMax = point.endErrorMax = run.errorMax;
      point.errorRms = point.endErrorRms = run.errorRms;
    }
  }
  setDisplacement(loaded, truth);
  return truth;
}

ChartTruth truthOfRun(const LoadedScene& loaded, const std::vector<RecordedFrame>& moments) {
  ChartTruth truth;
  for (const RecordedFrame& m : moments) truth.moments.push_back(m.frame);
  for (const SceneBody& body : loaded.scene.bodies) truth.known.emplace_back(body.model->restNodes.size(), 1);
  setDisplacement(loaded, truth);
  return truth;
}

void measureErrors(const LoadedScene& loaded, const ChartTruth& truth, const std::vector<RecordedFrame>& moments,
                   ChartPoint& point) {
  const std::vector<std::vector<char>> underLoad = loadedNodes(loaded);
  Deviation all, end, atLoads, elsewhere;
  for (std::size_t k = 0; k < moments.size(); ++k) {
    for (std::size_t b = 0; b < loaded.scene.bodies.size(); ++b) {
      for (std::size_t i = 0; i < truth.known[b].size(); ++i) {
        if (!truth.known[b][i]) continue;
        const double squared =
            (moments[k].frame.bodies[b].nodes[i] - truth.moments[k].bodies[b].nodes[i]).squaredNorm();
        all.add(squared);
        if (k + 1 < moments.size()) continue;
        end.add(squared);
        (underLoad[b][i] ? atLoads : elsewhere).add(squared);
      }
    }
  }
  const double percent = 100 / truth.displacement;
  point.errorMax = percent * all.largest;
  point.errorRms = percent * all.rms();
  point.endErrorMax = percent * end.largest;
  point.endErrorRms = percent * end.rms();
  if (atLoads.count == 0) return;
  point.loadedErrorMax = percent * atLoads.largest;
  point.loadedErrorRms = percent * atLoads.rms();
  if (elsewhere.count == 0) return;
  point.restErrorMax = percent * elsewhere.largest;
  point.restErrorRms = percent * elsewhere.rms();
}

}  // namespace medulla
