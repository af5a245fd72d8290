#pragma once

#include <vector>

#include "app/simulation.h"
#include "render/renderer.h"
#include "render/strip_chart.h"

namespace medulla {

// The force on the hand as the viewer of a picture sees it: an arrow at each tool's proxy, and a strip chart of its
// size over the last five seconds. Both have one range, a round number that follows the largest force so far and never
// shrinks: small forces are seen as well as large ones. An arrow of the whole range is a fifth of the picture high at
// the camera's target.
class ForceView {
 public:
  explicit ForceView(const LoadedScene& loaded);
  void afterFrame(const Simulation& simulation);  // every dynamics frame, in order
  StripChart chart(const PictureState& state);    // times do not fall
  // To a picture that is composed, in the range of the last chart.
  void addArrows(const PictureState& state, Picture& picture) const;

 private:
  void growRange(double time);

  const LoadedScene* loaded_;
  std::vector<std::vector<float>> sizes_;  // N, [tool][tick], from time 0
  std::size_t seen_ = 0;                   // ticks that the range covers
  double range_;                           // N
};

}  // namespace medulla
