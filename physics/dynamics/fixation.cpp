#include "physics/dynamics/fixation.h"

#include "physics/model/attachment.h"

namespace medulla {

std::vector<int> spheresHeldBy(const SoftBodyModel& model, const std::vector<int>& fixedNodes) {
  std::vector<double> area(model.spheres.size(), 0), fixedArea = area;
  const auto add = [&](int node, std::vector<double>& to) {
    const HostShares hosts = hostShares(model.attachments[node], model.links);
    for (int k = 0; k < 2; ++k) to[hosts.sphere[k]] += hosts.share[k] * model.attachments[node].area;
  };
  for (std::size_t i = 0; i < model.attachments.size(); ++i) add(static_cast<int>(i), area);
  for (const int node : fixedNodes) add(node, fixedArea);
  std::vector<int> out;
  for (std::size_t s = 0; s < area.size(); ++s)
    if (area[s] > 0 && fixedArea[s] >= 0.5 * area[s]) out.push_back(static_cast<int>(s));
  return out;
}

}  // namespace medulla
