#include "physics/dynamics/fixation.h"

#include "physics/model/attachment.h"
#include "physics/sort_unique.h"

namespace medulla {

// A sphere is held where at least half of the surface that hangs on it is: of all that it has a share in, or of what
// hangs on it alone, if that is a fair part, as the face at the end of a bar is.
std::vector<int> spheresHeldBy(const SoftBodyModel& model, const std::vector<int>& fixedNodes) {
  constexpr double kLeastOwn = 0.2;
  struct Area {
    double shared = 0, own = 0;
    int ownNodes = 0;
  };
  std::vector<Area> all(model.spheres.size()), fixed = all;
  const auto add = [&](int node, std::vector<Area>& to) {
    const Attachment& a = model.attachments[node];
    const HostShares hosts = hostShares(a, model.links);
    for (int k = 0; k < 2; ++k) to[hosts.sphere[k]].shared += hosts.share[k] * a.area;
    if (a.onLink) return;
    to[a.host].own += a.area;
    ++to[a.host].ownNodes;
  };
  for (std::size_t i = 0; i < model.attachments.size(); ++i) add(static_cast<int>(i), all);
  for (const int node : fixedNodes) add(node, fixed);
  std::vector<int> out;
  for (std::size_t s = 0; s < all.size(); ++s) {
    const bool ofAll = fixed[s].shared > 0 && fixed[s].shared >= 0.5 * all[s].shared;
    // Three nodes at least, or nothing would say how it is turned.
    const bool ofOwn =
        fixed[s].ownNodes >= 3 && fixed[s].own >= 0.5 * all[s].own && all[s].own >= kLeastOwn * all[s].shared;
    if (ofAll || ofOwn) out.push_back(static_cast<int>(s));
  }
  return out;
}

}  // namespace medulla
