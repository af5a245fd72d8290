#include "app/files/model_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "app/files/identified_part.h"
#include "app/files/model_rows.h"
#include "app/files/output_file.h"
#include "app/files/text.h"
#include "physics/model/mesh_topology.h"

// The arrays of a model, one element each, one line of numbers per entry. The columns are those of the structs in
// physics/model/soft_body_model.h, in their order; matrices column by column; lists of differing length start with it.
namespace medulla {

namespace {

constexpr int kFormatVersion = 4;

const XmlRules& modelRules() {
  static const XmlRules rules = [] {
    XmlRules out = {{"model", {"version", "name", "mesh_hash", "settings"}, {}, {}}};
    for (const char* array :
         {"input_vertices", "nodes", "triangles", "edges", "spheres", "links", "attachments", "buckets",
          "skeleton_nodes", "skeleton_links", "render_vertices", "render_stencils", "render_triangles"}) {
      out.front().children.push_back({array, 1, 1});
      out.push_back({array, {"rows"}, {}, {}, true});
    }
    out.front().children.push_back({"identified", 0, 1});
    for (const XmlRule& rule : identifiedRules()) out.push_back(rule);
    return out;
  }();
  return rules;
}

// ---- writing ----

void putVolumeModel(std::string& out, const SoftBodyModel& model) {
  putRows(out, "spheres", model.spheres.size(), [&](std::size_t k) {
    const FillingSphere& s = model.spheres[k];
    put(out, s.restBallCentre, s.radius, s.restFrame, s.restLinkEnd, s.volume, s.secondMoment);
  });
  putRows(out, "links", model.links.size(), [&](std::size_t k) {
    const ElasticLink& l = model.links[k];
    put(out, l.sphere0, l.sphere1);
    for (const LinkSection& s : l.sections) put(out, s.area, s.bendingMomentU, s.bendingMomentV, s.torsionConstant);
    put(out, l.restU);
  });
  putRows(out, "attachments", model.attachments.size(), [&](std::size_t k) {
    const Attachment& a = model.attachments[k];
    put(out, a.onLink ? 1 : 0, a.host, a.along, a.restOffset, a.area, a.volume, a.massSphere);
  });
  putRows(out, "buckets", model.buckets.size(),
          [&](std::size_t k) { put(out, static_cast<int>(model.buckets[k].size()), model.buckets[k]); });
}

void putRenderSurface(std::string& out, const RenderSurface& s) {
  const std::size_t vertices = s.restPosition.size();
  assert(s.first.size() == vertices + 1 && s.offset.size() == vertices);
  putRows(out, "render_vertices", vertices,
          [&](std::size_t k) { put(out, s.first[k + 1] - s.first[k], s.offset[k], s.restPosition[k]); });
  putRows(out, "render_stencils", s.node.size(),
          [&](std::size_t k) { put(out, s.node[k], s.weight[k], s.tangent0[k], s.tangent1[k]); });
  putArray(out, "render_triangles", s.triangles);
}

// ---- reading ----

std::uint64_t readMeshHash(const XmlElement& root) {
  const std::string text = readText(root, "mesh_hash");
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.size() != 16)
    refuse(root, "mesh_hash", "expected 16 hexadecimal digits");
  return value;
}

// Every edge of every triangle must be met once in the other direction.
bool isClosed(const std::vector<std::array<int, 3>>& triangles) {
  std::vector<std::array<int, 2>> forward, backward;
  for (const std::array<int, 3>& t : triangles) {
    for (int k = 0; k < 3; ++k) {
      forward.push_back({t[k], t[(k + 1) % 3]});
      backward.push_back({t[(k + 1) % 3], t[k]});
    }
  }
  std::sort(forward.begin(), forward.end());
  std::sort(backward.begin(), backward.end());
  const bool once = std::adjacent_find(forward.begin(), forward.end()) == forward.end();
  return once && !triangles.empty() && forward == backward;
}

constexpr double kLargestCoordinate = 1e6;  // m, as of meshes
constexpr double kLeastVolume = 1e-12;      // of the cube of its diagonal: a wire of a micron per metre has as much

void readSurface(const std::string& path, const XmlElement& root, SoftBodyModel& model) {
  Rows nodes(path, root, "nodes");
  nodes.forEach([&] {
    nodes.get(model.restNodes.emplace_back());
    nodes.require(model.restNodes.back().cwiseAbs().maxCoeff() <= kLargestCoordinate, "a place beyond 1e6 m");
  });
  const std::size_t count = model.restNodes.size();
  Rows inputs(path, root, "input_vertices");
  inputs.forEach([&] { model.nodeOfInputVertex.push_back(inputs.index(count, -1)); });
  const std::vector<int>& given = model.nodeOfInputVertex;
  inputs.require(given.empty() || *std::max_element(given.begin(), given.end()) >= 0, "none of them is a node");

  Rows triangles(path, root, "triangles");
  triangles.forEach([&] { model.triangles.push_back(triangles.indices<3>(count)); });
  triangles.require(isClosed(model.triangles), "the surface is not closed and wound one way");
  const TriangleMesh surface{model.restNodes, model.triangles};
  triangles.require(enclosedVolume(surface) > kLeastVolume * std::pow(boundsDiagonal(surface), 3),
                    "the surface is flat or inside out");
  std::vector<char> isUsed(count, 0);
  for (const std::array<int, 3>& t : model.triangles)
    for (const int node : t) isUsed[node] = 1;
  triangles.require(std::count(isUsed.begin(), isUsed.end(), 0) == 0, "a node is in none of them");
  Rows edges(path, root, "edges");
  edges.forEach([&] { model.edges.push_back(edges.indices<2>(count)); });
  edges.require(model.edges == uniqueEdges({model.restNodes, model.triangles}),
                "not the edges of the triangles, lower node first, sorted");
}

void readSpheres(const std::string& path, const XmlElement& root, SoftBodyModel& model) {
  Rows rows(path, root, "spheres");
  rows.forEach([&] {
    FillingSphere& s = model.spheres.emplace_back();
    rows.get(s.restBallCentre, s.radius, s.restFrame, s.restLinkEnd, s.volume, s.secondMoment);
    rows.require(s.radius > 0, "a radius that is not positive");
    rows.requireMoments(s.volume, s.secondMoment);
  });
  rows.require(!model.spheres.empty(), "expected at least one sphere");
}

void readLinks(const std::string& path, const XmlElement& root, SoftBodyModel& model) {
  Rows rows(path, root, "links");
  rows.forEach([&] {
    ElasticLink& l = model.links.emplace_back();
    l.sphere0 = rows.index(model.spheres.size());
    l.sphere1 = rows.index(model.spheres.size());
    const Eigen::Vector3d line = model.spheres[l.sphere1].restLinkEnd - model.spheres[l.sphere0].restLinkEnd;
    rows.require(line.norm() > 0, "a link without length");
    for (LinkSection& s : l.sections) {
      rows.get(s.area, s.bendingMomentU, s.bendingMomentV, s.torsionConstant);
      rows.require(s.area > 0, "an area that is not positive");
      rows.require(s.bendingMomentU > 0 && s.bendingMomentV > 0, "a bending moment that is not positive");
      rows.require(s.torsionConstant > 0, "a torsion constant that is not positive");
    }
    rows.get(l.restU);
    // Computed in double and written exactly, so only rounding separates them from the ideal.
    rows.require(std::abs(l.restU.norm() - 1) <= 1e-9, "a restU that is not a unit vector");
    rows.require(std::abs(l.restU.dot(line)) <= 1e-6 * line.norm(), "a restU that is not perpendicular to its link");
  });
}

void readAttachments(const std::string& path, const XmlElement& root, SoftBodyModel& model) {
  Rows rows(path, root, "attachments");
  rows.forEach([&] {
    Attachment& a = model.attachments.emplace_back();
    a.onLink = rows.index(2) == 1;
    a.host = rows.index(a.onLink ? model.links.size() : model.spheres.size());
    rows.get(a.along, a.restOffset, a.area, a.volume);
    a.massSphere = rows.index(model.spheres.size());
    rows.require(a.along >= 0 && a.along <= (a.onLink ? 1 : 0), "a position along its host outside 0 to 1 (sphere: 0)");
    rows.require(a.area >= 0 && a.volume >= 0, "a negative area or volume");
  });
  rows.require(model.attachments.size() == model.restNodes.size(), "expected one attachment per node");
}

void readBuckets(const std::string& path, const XmlElement& root, SoftBodyModel& model) {
  Rows rows(path, root, "buckets");
  std::vector<bool> taken(model.triangles.size(), false);
  std::size_t total = 0;
  rows.forEach([&] {
    std::vector<int>& bucket = model.buckets.emplace_back();
    const int size = rows.index(model.triangles.size() + 1);
    for (int k = 0; k < size; ++k) {
      const int triangle = bucket.emplace_back(rows.index(model.triangles.size()));
      rows.require(!taken[triangle], "a triangle in two buckets");
      taken[triangle] = true;
      ++total;
    }
  });
  rows.require(model.buckets.size() == model.spheres.size(), "expected one bucket per sphere");
  rows.require(total == model.triangles.size(), "a triangle in no bucket");
}

void readSkeleton(const std::string& path, const XmlElement& root, Skeleton& skeleton) {
  Rows nodes(path, root, "skeleton_nodes");
  nodes.forEach([&] { nodes.get(skeleton.nodes.emplace_back()); });
  Rows links(path, root, "skeleton_links");
  links.forEach([&] { skeleton.links.push_back(links.indices<2>(skeleton.nodes.size())); });
}

void readRenderSurface(const std::string& path, const XmlElement& root, std::size_t nodes, RenderSurface& s) {
  Rows stencils(path, root, "render_stencils");
  stencils.forEach([&] {
    s.node.push_back(stencils.index(nodes));
    stencils.get(s.weight.emplace_back(), s.tangent0.emplace_back(), s.tangent1.emplace_back());
  });
  Rows vertices(path, root, "render_vertices");
  s.first = {0};
  vertices.forEach([&] {
    const int begin = s.first.back();
    const int end = begin + vertices.index(s.node.size() - begin + 1, 1);
    vertices.requireAscending({s.node.begin() + begin, s.node.begin() + end},
                              "nodes of a stencil that are not ascending");
    vertices.get(s.offset.emplace_back(), s.restPosition.emplace_back());
    s.first.push_back(end);
  });
  vertices.require(s.first.back() == static_cast<long>(s.node.size()), "stencil sizes that do not add up");
  Rows triangles(path, root, "render_triangles");
  triangles.forEach([&] { s.triangles.push_back(triangles.indices<3>(s.restPosition.size())); });
}

}  // namespace

void writeModel(const std::string& path, const SoftBodyModel& model) {
  OutputFile file(path);
  std::string out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  out += fmt::format("<model version=\"{}\" name=\"{}\" mesh_hash=\"{:016x}\" settings=\"{}\">\n", kFormatVersion,
                     escapedXml(model.name), model.meshHash, escapedXml(model.settings));
  putArray(out, "input_vertices", model.nodeOfInputVertex);
  putArray(out, "nodes", model.restNodes);
  putArray(out, "triangles", model.triangles);
  putArray(out, "edges", model.edges);
  putVolumeModel(out, model);
  putArray(out, "skeleton_nodes", model.skeleton.nodes);
  putArray(out, "skeleton_links", model.skeleton.links);
  putRenderSurface(out, model.renderSurface);
  if (model.identified) putIdentified(out, *model.identified);
  file.write(out + "</model>\n");
  file.commit();
}

bool isModel(const std::string& path) {
  try {
    return rootElementOf(path) == modelRules().front().element;
  } catch (const std::runtime_error&) {
    return false;
  }
}

SoftBodyModel readModel(const std::string& path) {
  // Another version may have other elements: it is the first thing to be told.
  const auto checkVersion = [](const XmlElement& root) {
    const int version = readInteger(root, "version", kFormatVersion);
    if (version == kFormatVersion) return;
    refuse(root, "version", "expected " + std::to_string(kFormatVersion) + "; make the model anew with medulla build");
  };
  const XmlElement root = readXml(path, modelRules(), checkVersion);
  SoftBodyModel model;
  model.name = root.find("name")->value;
  model.meshHash = readMeshHash(root);
  model.settings = root.find("settings")->value;
  readSurface(path, root, model);
  readSpheres(path, root, model);
  readLinks(path, root, model);
  readAttachments(path, root, model);
  readBuckets(path, root, model);
  readSkeleton(path, root, model.skeleton);
  readRenderSurface(path, root, model.restNodes.size(), model.renderSurface);
  for (const XmlElement* e : childrenOf(root, "identified")) model.identified = readIdentified(path, *e, model);
  return model;
}

}  // namespace medulla
