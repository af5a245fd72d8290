#include "app/force_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/round_number.h"
#include "app/scene_view.h"

namespace medulla {

namespace {

constexpr double kWindow = 5;           // s
constexpr double kSmallestRange = 0.2;  // N

// Linear RGB, bright on tissue and on the chart's dark paper, told apart by lightness too.
constexpr glm::vec4 kColours[] = {
    {0.95f, 0.75f, 0.05f, 1}, {0.10f, 0.60f, 0.95f, 1}, {0.15f, 0.80f, 0.35f, 1}, {0.90f, 0.35f, 0.75f, 1}};

glm::vec4 colourOf(std::size_t tool) {
  return kColours[tool % std::size(kColours)];
}

}  // namespace

ForceView::ForceView(const LoadedScene& loaded)
    : loaded_(&loaded), sizes_(loaded.scene.tools.size()), range_(kSmallestRange) {}

void ForceView::afterFrame(const Simulation& simulation) {
  const ServoRecord& record = simulation.record();
  for (std::size_t k = 0; k < sizes_.size(); ++k)
    for (std::size_t tick = sizes_[k].empty() ? 0 : 1; tick < record.tools.size(); ++tick)
      sizes_[k].push_back(float(record.tools[tick][k].force.norm()));
}

void ForceView::growRange(double time) {
  const auto ticks = static_cast<std::size_t>(std::floor(time * loaded_->scene.servoRate + 1e-6)) + 1;
  for (; seen_ < std::min(ticks, sizes_[0].size()); ++seen_)
    for (const auto& sizes : sizes_)
      if (sizes[seen_] > range_) range_ = nextRoundNumber(sizes[seen_]);
}

StripChart ForceView::chart(const PictureState& state) {
  StripChart chart;
  if (sizes_.empty()) return chart;
  growRange(state.time);
  chart.range = float(range_);
  chart.seconds = float(kWindow);
  chart.now = float(state.time);
  chart.rangeLabel = fmt::format("{:g} N", range_);
  chart.windowLabel = fmt::format("{:g} s", kWindow);
  const auto window = static_cast<std::size_t>(std::lround(kWindow * loaded_->scene.servoRate));
  for (std::size_t k = 0; k < sizes_.size(); ++k) {
    StripCurve curve{colourOf(k), std::vector<float>(window + 1, 0.f),
                     fmt::format("{:.2f} N", state.tools[k].force.norm())};
    for (std::size_t back = 0; back <= window && back < seen_; ++back)
      curve.values[window - back] = sizes_[k][seen_ - 1 - back];
    chart.curves.push_back(std::move(curve));
  }
  return chart;
}

void ForceView::addArrows(const PictureState& state, Picture& picture) const {
  const float height = heightAtTarget(cameraAt(loaded_->scene.camera, state.time));  // not as a tall picture widens it
  for (std::size_t k = 0; k < sizes_.size(); ++k) {
    const Eigen::Vector3d& force = state.tools[k].force;
    if (force.norm() <= 0.005 * range_) continue;
    const glm::vec3 from = toGlm(state.tools[k].proxy), along = 0.2f * height * toGlm(force / range_);
    picture.overlay.arrows.push_back({from, from + along, 0.006f * height, colourOf(k)});
  }
}

}  // namespace medulla
