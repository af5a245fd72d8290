#include "assets/shapes/obj_writer.h"

#include <fmt/format.h>

#include <iterator>

namespace medulla {

std::string objText(const TriangleMesh& meshInMillimetres, const std::string& name) {
  std::string text = fmt::format("# {}: metres, {} vertices, {} triangles; made by medulla_shapes\no {}\n", name,
                                 meshInMillimetres.vertices.size(), meshInMillimetres.triangles.size(), name);
  auto out = std::back_inserter(text);
  for (const Eigen::Vector3d& v : meshInMillimetres.vertices)
    fmt::format_to(out, "v {:.7f} {:.7f} {:.7f}\n", v.x() / 1000, v.y() / 1000, v.z() / 1000);
  for (const auto& t : meshInMillimetres.triangles) fmt::format_to(out, "f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

}  // namespace medulla
