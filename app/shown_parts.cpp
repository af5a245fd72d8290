#include "app/shown_parts.h"

#include <algorithm>
#include <stdexcept>

#include "app/files/text.h"

namespace medulla {

const std::vector<ShownPart>& shownParts() {
  static const std::vector<ShownPart> parts = {
      {"mesh", &Shown::mesh, true, "the surface's springs"},
      {"skeleton", &Shown::skeleton, true, "medial axis that the spheres were placed along"},
      {"spheres", &Shown::spheres, true, "filling spheres, grey where they are held"},
      {"buckets", &Shown::buckets, true, "their second radius, around the triangles that the proxy looks for in them"},
      {"links", &Shown::links, true, "elastic links between the spheres"},
      {"frames", &Shown::frames, true, "t, u and v at both ends of every link: red, green, blue"},
      {"attachments", &Shown::attachments, true, "from every node to its sphere or link"},
      {"proxy", &Shown::proxy, false, "proxy, device and the spring between them"},
      {"force", &Shown::force, false, "on the hand: an arrow at the proxy, and a strip chart of the last seconds"},
      {"caption", &Shown::caption, false, "scene, time, and what the scene's captions say"},
  };
  return parts;
}

static const ShownPart& findPart(const std::string& name) {
  const std::vector<ShownPart>& parts = shownParts();
  const auto found = std::find_if(parts.begin(), parts.end(), [&](const ShownPart& p) { return name == p.name; });
  if (found != parts.end()) return *found;
  std::vector<std::string> known;
  known.reserve(parts.size());
  for (const ShownPart& p : parts) known.emplace_back(p.name);
  throw std::invalid_argument(hintAndNames(name, known));
}

bool namesModelPart(const std::vector<std::string>& names) {
  return std::any_of(names.begin(), names.end(), [](const std::string& name) { return findPart(name).ofModel; });
}

Shown readShown(const std::vector<std::string>& names) {
  Shown shown;
  for (const std::string& name : names) shown.*findPart(name).part = true;
  if (!namesModelPart(names)) shown.mesh = shown.spheres = shown.links = true;
  return shown;
}

std::string namesOf(const Shown& shown) {
  std::vector<std::string> names;
  for (const ShownPart& p : shownParts())
    if (shown.*p.part) names.emplace_back(p.name);
  return joined(names, ",");
}

}  // namespace medulla
