#pragma once

#include <vector>

#include "app/commands/run.h"
#include "app/files/chart_file.h"

// What the runs of a chart are measured against, and how far off they are.
namespace medulla {

struct ChartTruth {
  std::vector<DynamicsFrame> moments;    // where surface nodes belong, at the moments that runs record
  std::vector<std::vector<char>> known;  // per body and node: whether that is known
  double displacement = 0;               // m, of the node that is farthest from where it lies at rest; > 1e-9
  ChartCost cost = ChartCost::perSimulatedSecond;
  double step = 0;                  // s, of the reference run, where that is one of this program,
  int spheres = 0;                  // and its number of spheres
  std::string ownCurve;             // of several models, that of the same method and model: its error is of steps alone
  std::vector<ChartPoint> ownRuns;  // what the references' own program took
};

// Whether some body has a reference; those are then all that counts.
bool namesReference(const LoadedScene& loaded);

// Both throw std::runtime_error where nothing moves.
ChartTruth truthOfReferences(const LoadedScene& loaded);
ChartTruth truthOfRun(const LoadedScene& loaded, const std::vector<RecordedFrame>& moments);

// The errors of a run that recorded the truth's moments.
void measureErrors(const LoadedScene& loaded, const ChartTruth& truth, const std::vector<RecordedFrame>& moments,
                   ChartPoint& point);

}  // namespace medulla
