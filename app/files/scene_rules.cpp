#include "app/files/scene_rules.h"

namespace medulla {

const XmlRules& sceneRules() {
  constexpr int many = std::numeric_limits<int>::max();
  static const XmlRules rules = {
      {"scene",
       {"name"},
       {},
       {{"clock", 1, 1},
        {"dynamics", 0, 1},
        {"tissue", 1, many},
        {"body", 1, many},
        {"static", 0, many},
        {"tool", 0, many},
        {"camera", 1, 1},
        {"light", 0, 1},
        {"output", 0, 1}}},
      {"clock", {"duration"}, {"servo", "dynamics", "settle"}, {}},
      {"dynamics", {}, {"integrator", "order", "gravity", "ambient_drag", "substeps", "contact", "sleep_after"}, {}},
      {"tissue", {"name"}, {"young", "poisson", "density", "damping", "friction"}, {}},
      {"body",
       {"name", "model", "tissue", "look"},
       {"position", "orientation", "links", "surface", "reference"},
       {{"fix", 0, many}, {"drive", 0, many}, {"load", 0, many}, {"links", 0, many, true}, {"neighbours", 0, 1}}},
      {"fix", {}, {"sphere", "spheres", "box", "plane", "vertices", "dof"}, {}},
      {"drive", {"sphere", "axis", "amplitude", "frequency"}, {"phase", "velocity", "dof"}, {}},
      {"load", {}, {"force", "from", "to", "box", "sphere", "plane", "vertices", "file"}, {}},
      {"links", {}, {"select", "box", "sphere", "plane", "elongation", "flexion", "torsion"}, {}},
      {"neighbours", {"names"}, {}, {}},
      {"static",
       {"shape"},
       {"mesh", "look", "position", "orientation", "unit", "normal", "size", "radius", "contact", "friction"},
       {}},
      {"tool",
       {"name", "trajectory"},
       {"radius", "stiffness", "damping", "friction", "force_max", "grip_radius", "grip_force_max"},
       {}},
      {"camera", {"position", "target"}, {"fov", "endoscope"}, {{"key", 0, many}}},
      {"key", {"t"}, {"position", "target", "fov"}, {}},
      {"light", {}, {"offset", "position", "intensity", "reference_distance", "haze", "haze_distance", "caustics"}, {}},
      {"output", {}, {"size", "fps", "golden"}, {{"caption", 0, many}}},
      {"caption", {"from", "to", "text"}, {}, {}},
  };
  return rules;
}

}  // namespace medulla
