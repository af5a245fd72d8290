#include "app/files/surface_file.h"

#include <cassert>

#include "app/files/number_text.h"

namespace medulla {

namespace {

void appendVertex(std::string& out, const Eigen::Vector3d& x) {
  out += 'v';
  for (int k = 0; k < 3; ++k) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), x[k], std::chars_format::general, 17).ptr;
    out += ' ';
    out.append(digits, end);
  }
  out += '\n';
}

// The node that each vertex of the file stands for.
std::vector<int> nodesOfVertices(const SoftBodyModel& model) {
  std::vector<int> nodes = model.nodeOfInputVertex;
  std::vector<bool> present(model.restNodes.size(), false);
  int kept = 0;
  for (const int node : nodes) {
    if (node < 0) continue;
    kept = node;
    break;
  }
  for (int& node : nodes) {
    if (node < 0) node = kept;
    kept = node;
    present[node] = true;
  }
  for (std::size_t node = 0; node < present.size(); ++node)
    if (!present[node]) nodes.push_back(static_cast<int>(node));
  return nodes;
}

}  // namespace

std::string surfaceText(const std::vector<BodyDescription>& bodies, const DynamicsFrame& frame) {
  assert(bodies.size() == frame.bodies.size());
  std::string out;
  std::size_t before = 0;  // vertices of the bodies so far: OBJ counts through the whole file
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const SoftBodyModel& model = *bodies[b].model;
    const std::vector<int> nodes = nodesOfVertices(model);
    std::vector<std::size_t> numberOfNode(model.restNodes.size());
    for (std::size_t v = nodes.size(); v-- > 0;) {
      const bool dropped = v < model.nodeOfInputVertex.size() && model.nodeOfInputVertex[v] < 0;
      if (!dropped) numberOfNode[nodes[v]] = before + v + 1;  // the first of welded vertices remains
    }
    out += "o " + bodies[b].name + "\n";
    for (const int node : nodes) appendVertex(out, frame.bodies[b].nodes[node]);
    for (const auto& t : model.triangles) {
      out += 'f';
      for (const int node : t) {
        out += ' ';
        appendNumber(out, numberOfNode[node]);
      }
      out += '\n';
    }
    before += nodes.size();
  }
  return out;
}

}  // namespace medulla
